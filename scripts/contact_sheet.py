#!/usr/bin/env python3
"""Joins previews (8-bit PNGs) with their names into one sheet for looking at.

usage: contact_sheet.py SHEET.png PREVIEW.png... [--columns N] [--width PIXELS]

Every picture is brought to the same width by averaging whole blocks of pixels, never enlarged.
A picture may be given as LABEL=FILE; otherwise its file name is the label. Standard library only.
"""

import argparse
import os
import struct
import sys
import zlib
from itertools import accumulate

# Columns of 5 x 7 letters, from the left, the lowest bit on top.
GLYPHS = {
    " ": "0000000000", "-": "0808080808", "_": "4040404040", ".": "0060600000",
    "/": "6010080403", ":": "0036360000", "=": "1414141414", "(": "001c224100",
    ")": "0041221c00", "+": "08083e0808", "%": "2313086462", "#": "147f147f14",
    "0": "3e5149453e", "1": "00427f4000", "2": "4261514946", "3": "2141454b31",
    "4": "1814127f10", "5": "2745454539", "6": "3c4a494930", "7": "0171090503",
    "8": "3649494936", "9": "064949291e", "A": "7e1111117e", "B": "7f49494936",
    "C": "3e41414122", "D": "7f4141221c", "E": "7f49494941", "F": "7f09090901",
    "G": "3e4149497a", "H": "7f0808087f", "I": "00417f4100", "J": "2040413f01",
    "K": "7f08142241", "L": "7f40404040", "M": "7f020c027f", "N": "7f0408107f",
    "O": "3e4141413e", "P": "7f09090906", "Q": "3e4151215e", "R": "7f09192946",
    "S": "4649494931", "T": "01017f0101", "U": "3f4040403f", "V": "1f2040201f",
    "W": "3f4038403f", "X": "6314081463", "Y": "0708700807", "Z": "6151494543",
    "?": "0201510906", ",": "0050300000",
}
LETTER = 6  # columns of a letter with its gap
SCALE = 2
LABEL_HEIGHT = 7 * SCALE + 8
MARGIN = 8
PAPER = 255


def read_png(path):
    """The width and the rows (RGB bytes) of an 8-bit, not interlaced PNG."""
    with open(path, "rb") as file:
        stream = file.read()
    if stream[:8] != b"\x89PNG\r\n\x1a\n":
        sys.exit(f"{path}: not a PNG")
    at, packed, header = 8, [], None
    while at + 12 <= len(stream):
        (length,), kind = struct.unpack_from(">I", stream, at), stream[at + 4 : at + 8]
        body = stream[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed.append(body)
        at += 12 + length
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(header[3]) if header else None
    if channels is None or header[2] != 8 or header[6] != 0:
        sys.exit(f"{path}: only 8-bit grey or colour without interlace is read")
    rows = unfilter(zlib.decompress(b"".join(packed)), header[0] * channels, channels)
    return header[0], [to_rgb(row, channels) for row in rows]


def unfilter(filtered, stride, step):
    """Undoes the five row filters of PNG."""
    above, rows = bytes(stride), []
    for start in range(0, len(filtered), stride + 1):
        kind, row = filtered[start], bytearray(filtered[start + 1 : start + 1 + stride])
        if kind == 1:
            for channel in range(step):
                row[channel::step] = bytes(accumulate(row[channel::step], lambda a, b: a + b & 255))
        elif kind == 2:
            row = bytearray((a + b) & 255 for a, b in zip(row, above))
        elif kind in (3, 4):
            for i, byte in enumerate(row):
                left = row[i - step] if i >= step else 0
                if kind == 3:
                    row[i] = byte + (left + above[i] >> 1) & 255
                else:
                    corner = above[i - step] if i >= step else 0
                    row[i] = byte + paeth(left, above[i], corner) & 255
        rows.append(row)
        above = row
    return rows


def paeth(left, above, corner):
    """The neighbour that is nearest to left + above - corner."""
    guess = left + above - corner
    return min((left, above, corner), key=lambda value: abs(guess - value))


def to_rgb(row, channels):
    """Drops alpha, triples grey."""
    if channels == 3:
        return row
    rgb = bytearray(len(row) // channels * 3)
    for channel in range(3):
        rgb[channel::3] = row[(channel if channels == 4 else 0) :: channels]
    return rgb


def shrink(width, rows, block):
    """Averages block x block pixels into one."""
    if block == 1:
        return width, rows
    small_width, small = width // block, []
    for y in range(0, len(rows) - block + 1, block):
        row = bytearray(small_width * 3)
        for channel in range(3):
            parts = [
                line[3 * dx + channel : 3 * block * small_width : 3 * block]
                for line in rows[y : y + block]
                for dx in range(block)
            ]
            row[channel::3] = bytes(sum(pixel) // (block * block) for pixel in zip(*parts))
        small.append(row)
    return small_width, small


def label_rows(text, width):
    """A strip of paper with the text on it, cut at the right."""
    rows = [bytearray([PAPER]) * (3 * width) for _ in range(LABEL_HEIGHT)]
    for place, letter in enumerate(text.upper()[: max(0, width // (LETTER * SCALE))]):
        for column, bits in enumerate(bytes.fromhex(GLYPHS.get(letter, GLYPHS["?"]))):
            for line in range(7 * SCALE):
                if bits >> line // SCALE & 1:
                    x = (place * LETTER + column) * SCALE
                    rows[4 + line][3 * x : 3 * (x + SCALE)] = bytes(3 * SCALE)
    return rows


def write_png(path, width, rows):
    """Writes RGB rows, whole or not at all."""

    def chunk(kind, body):
        check = struct.pack(">I", zlib.crc32(kind + body))
        return struct.pack(">I", len(body)) + kind + body + check

    header = struct.pack(">IIBBBBB", width, len(rows), 8, 2, 0, 0, 0)
    packed = zlib.compress(b"".join(b"\0" + row for row in rows), 6)
    with open(path + ".partial", "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"IDAT", packed) + chunk(b"IEND", b""))
    os.replace(path + ".partial", path)


def join(cells, columns):
    """Lays pictures (width and rows) out in columns; the width and the rows of the sheet."""
    columns = min(columns, len(cells))
    cell_width = max(width for width, _ in cells) + MARGIN
    sheet = []
    for first in range(0, len(cells), columns):
        line = cells[first : first + columns]
        for y in range(max(len(rows) for _, rows in line) + MARGIN):
            row = bytearray([PAPER]) * (3 * cell_width * columns)
            for place, (width, rows) in enumerate(line):
                if y < len(rows):
                    start = 3 * cell_width * place
                    row[start : start + 3 * width] = rows[y]
            sheet.append(row)
    return cell_width * columns, sheet


def main():
    """Reads, shrinks, labels and joins."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sheet")
    parser.add_argument("pictures", nargs="+", metavar="[LABEL=]PICTURE")
    parser.add_argument("--columns", type=int, default=2)
    parser.add_argument("--width", type=int, default=900, help="largest width of a picture")
    arguments = parser.parse_args()
    if arguments.columns < 1 or arguments.width < 1:
        parser.error("--columns and --width start at 1")

    cells = []
    for name in arguments.pictures:
        label, _, path = name.rpartition("=")
        width, rows = read_png(path)
        width, rows = shrink(width, rows, -(-width // arguments.width))
        label = label or os.path.splitext(os.path.basename(path))[0]
        cells.append((width, label_rows(label, width) + rows))

    write_png(arguments.sheet, *join(cells, arguments.columns))


if __name__ == "__main__":
    main()
