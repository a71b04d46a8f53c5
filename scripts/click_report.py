#!/usr/bin/env python3
"""Clicks through the pages of a report in headless Chromium, as a person would.

    scripts/click_report.py --index OUT/.brickmend/report/index.html --page page.html [--shots DIR]

Opens each page at desktop and phone width, light and dark, and once without script. Sorts, filters,
follows a link, moves the slider, turns the model. Any error on the console, any request that leaves
the machine and any part of a page that is wider than the window is a failure; the exit status is then 1.

Needs playwright (pip) and a Chromium: BRICKMEND_CHROMIUM names its program.
"""

import argparse
import os
import pathlib
import sys

from playwright.sync_api import sync_playwright

SIZES = {"desktop": (1280, 900), "phone": (390, 844), "narrow": (320, 640)}
# WebGL without a graphics card.
FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
if os.geteuid() == 0:
    # The sandbox of Chromium does not start as root.
    FLAGS.append("--no-sandbox")


class Failure(Exception):
    """What a person would see and should not."""


def demand(holds, words):
    if not holds:
        raise Failure(words)


def check_width(page, words):
    sizes = page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    demand(sizes[0] <= sizes[1], f"{words}: the page is {sizes[0]} px wide in {sizes[1]} px")


def names_shown(page):
    return page.locator("table.models tbody .name").all_inner_texts()


def click_catalogue(page):
    """Sorts, filters and pages the table."""
    models = page.evaluate("JSON.parse(document.getElementById('models-data').textContent).models")
    shown = names_shown(page)
    demand(len(shown) == min(100, len(models)), f"{len(shown)} of {len(models)} models are shown")
    select = page.locator("#sort")
    select.select_option("name")
    up = names_shown(page)
    page.locator("#turn").click()
    down = names_shown(page)
    demand(len(models) < 2 or up[0] != down[0], "turning the order around changes nothing")
    if len(models) <= 100:
        demand(up == down[::-1], "descending is not ascending backwards")
    select.select_option("size")
    sizes = [model["b"] for model in models]
    first = page.locator("table.models tbody td[data-name=Size]").first.text_content()
    demand(first.split("\u202f")[0] != "", "no size is shown")
    largest = max(models, key=lambda model: model["b"])["b"]
    demand(sizes.count(largest) > 1 or names_shown(page)[0] == next(
        model["n"] for model in models if model["b"] == largest), "the largest is not first")
    header = page.locator("table.models th[data-key=time] button")
    if header.is_visible():
        header.click()
        sort = page.locator("table.models th[data-key=time]").get_attribute("aria-sort")
        demand(sort == "descending", f"the heading says {sort}")
    wanted = models[len(models) // 2]["n"]
    page.locator("#find").fill(wanted)
    found = names_shown(page)
    demand(wanted in found, f"{wanted!r} is not found")
    demand(all(wanted.lower() in (m["n"] + (m.get("w") or "")).lower() for m in models
               if m["n"] in found), "what does not fit is found")
    page.locator("#find").fill("no such model \U0001f4a5")
    demand(names_shown(page) == [], "what is not there is found")
    page.locator("#find").fill("")
    word = models[0]["s"]
    page.locator("#standing").select_option(word)
    demand(all(badge == word for badge in page.locator("table.models .badge").all_inner_texts()),
           "the filter by verdict lets others through")
    page.locator("#standing").select_option("")
    if len(models) > 100:
        before = names_shown(page)
        page.locator("#later").click()
        demand(names_shown(page) != before, "the next page is the same")
        page.locator("#earlier").click()
        demand(names_shown(page) == before, "the way back leads elsewhere")
    select.select_option("urgency")


def follow_link(page):
    """Opens the page of the first model that has one, and comes back."""
    pages = [model["i"] for model in page.evaluate(
        "JSON.parse(document.getElementById('models-data').textContent).models") if model["p"] & 1]
    if not pages:
        return
    page.locator("#find").fill("")
    name = page.evaluate(
        "JSON.parse(document.getElementById('models-data').textContent).models"
        ".find((model) => model.p & 1).n")
    page.locator("#find").fill(name)
    picture = page.locator("table.models tbody img").first
    picture.scroll_into_view_if_needed()
    page.wait_for_function("(image) => image.complete && image.naturalWidth > 0",
                           arg=picture.element_handle())
    page.locator("table.models tbody a:not(.result)").first.click()
    page.wait_for_selector("#verdict")
    demand("/models/" in page.url, f"the link leads to {page.url}")
    check_width(page, "the model behind the link")
    page.locator("a.back").click()
    page.wait_for_selector("table.models")


def click_model(page):
    """Moves the slider, turns the model, looks at both sides."""
    after = page.locator("#compare figure").nth(1)
    clip = after.evaluate("(figure) => getComputedStyle(figure).clipPath")
    page.locator("#slider").focus()
    for _ in range(20):
        page.keyboard.press("ArrowRight")
    moved = after.evaluate("(figure) => getComputedStyle(figure).clipPath")
    demand(moved != clip, "the slider cuts nothing")
    box = page.locator("#compare").bounding_box()
    page.locator("#compare").click(position={"x": box["width"] * 0.25, "y": box["height"] / 2})
    value = float(page.locator("#slider").input_value())
    demand(abs(value - 25) < 2, f"a click at a quarter moves the slider to {value}")
    canvas = page.locator("#viewer canvas")
    if canvas.count() == 0:
        return
    canvas.scroll_into_view_if_needed()
    page.wait_for_function("() => document.querySelector('#viewer canvas').dataset.view")
    still = canvas.screenshot()
    demand(len(set(still)) > 50, "the canvas is empty")
    box = canvas.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + min(box["height"], 300) / 2)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 80, middle[1] + 30, steps=6)
    page.mouse.up()
    page.wait_for_timeout(100)
    demand(canvas.screenshot() != still, "dragging turns nothing")
    seen = canvas.get_attribute("data-view")
    page.mouse.wheel(0, -200)
    page.wait_for_timeout(100)
    demand(canvas.get_attribute("data-view") != seen, "scrolling zooms nothing")
    canvas.focus()
    seen = canvas.get_attribute("data-view")
    page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(100)
    demand(canvas.get_attribute("data-view") != seen, "keys turn nothing")
    page.locator("#viewer [data-side=before]").click()
    page.wait_for_timeout(100)
    demand(page.locator("#viewer output").inner_text() == "before", "the other side is not shown")
    page.locator("#viewer [data-reset]").click()
    page.locator("#viewer [data-side=after]").click()
    click_deviation(page, canvas)


def click_deviation(page, canvas):
    """Looks at the map of deviations, where the page has one."""
    if page.locator("#map").count() == 0:
        return
    picture = page.locator("#map img")
    demand(picture.evaluate("(image) => image.complete && image.naturalWidth > 0"), "no map is shown")
    marks = page.locator("#map .marks span").all_inner_texts()
    demand(len(marks) == 4 and sorted(marks, key=float) == marks, f"the scale says {marks}")
    scale = page.locator("#viewer .scale")
    demand(not scale.is_visible(), "there is a scale for what is not on it")
    canvas.scroll_into_view_if_needed()
    page.wait_for_timeout(100)
    plain = canvas.screenshot()
    page.locator("#viewer [data-side=deviation]").click()
    page.wait_for_timeout(150)
    demand(page.locator("#viewer output").inner_text() == "deviation", "the map is not told")
    demand(scale.is_visible(), "the map has no scale")
    canvas.scroll_into_view_if_needed()
    demand(canvas.screenshot() != plain, "the map has the colours of the model")


def open_page(browser, path, click, shots, kind):
    """All sizes and schemes of one page."""
    address = pathlib.Path(path).resolve().as_uri()
    for size, (width, height) in SIZES.items():
        for scheme in ("light", "dark"):
            words = f"{kind}, {size}, {scheme}"
            context = browser.new_context(
                viewport={"width": width, "height": height}, color_scheme=scheme,
                device_scale_factor=1 if size == "desktop" else 2)
            page = context.new_page()
            faults = []
            page.on("console", lambda message: faults.append(message.text)
                    if message.type in ("error", "warning") and "ReadPixels" not in message.text
                    else None)
            page.on("pageerror", lambda error: faults.append(str(error)))
            page.on("request", lambda request: faults.append(f"a request to {request.url}")
                    if not request.url.startswith(("file:", "data:")) else None)
            page.on("requestfailed", lambda request: faults.append(f"no {request.url}"))
            page.goto(address)
            check_width(page, words)
            ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
            light = sum(int(part) for part in ground.strip("rgb()").split(",")[:3]) > 380
            demand(light == (scheme == "light"), f"{words}: the ground is {ground}")
            try:
                click(page)
            except Failure as failure:
                raise Failure(f"{words}: {failure}") from failure
            check_width(page, words)
            if shots:
                page.mouse.move(0, 0)
                page.evaluate("window.scrollTo(0, 0)")
                page.wait_for_timeout(150)
                page.screenshot(path=f"{shots}/{kind}-{size}-{scheme}.png", full_page=True)

            demand(not faults, f"{words}: {'; '.join(faults[:5])}")
            context.close()
        context = browser.new_context(viewport={"width": width, "height": height},
                                      java_script_enabled=False)
        page = context.new_page()
        page.goto(address)
        if shots:
            page.screenshot(path=f"{shots}/{kind}-{size}-plain.png", full_page=True)
        plain = page.locator("main").inner_text()
        demand(len(plain) > 100, f"{kind}, {size}: without script there is nothing to read")
        demand(not page.locator("#slider, #controls").first.is_visible(),
               f"{kind}, {size}: without script there are fields that do nothing")
        context.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--index", help="page of a catalogue")
    parser.add_argument("--page", help="page of a model")
    parser.add_argument("--shots", help="folder for pictures of the screen")
    arguments = parser.parse_args()
    program = os.environ.get("BRICKMEND_CHROMIUM") or None
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        try:
            if arguments.index:
                def click(page):
                    click_catalogue(page)
                    follow_link(page)
                open_page(browser, arguments.index, click, arguments.shots, "catalogue")
            if arguments.page:
                open_page(browser, arguments.page, click_model, arguments.shots, "model")
        except Failure as failure:
            print(f"click_report: {failure}", file=sys.stderr)
            return 1
        finally:
            browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
