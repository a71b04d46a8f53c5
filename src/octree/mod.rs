//! What the bytes of the store mean: the lattice, bricks of cells, and the tree above them.
//!
//! Nothing here knows where bytes lie; nothing here knows a file format or a stage.

mod ambiguous;
mod binned;
mod border;
mod brick;
mod cell_brick;
mod domain;
mod edge_bits;
mod edge_brick;
mod edge_walk;
mod exposed;
mod flips;
mod index;
mod key;
mod lost;
mod occupancy;
mod plane;
pub(crate) mod points;
mod region;
mod sign_bricks;
mod soup_edges;
mod soup_spool;
mod touch;
mod triangle;

pub use ambiguous::{OWN_FACES, face_index, for_each_ambiguous_face};
pub use binned::{Bin, BinEntry, BinSpools, BinWalk, BinnedSoup, SoupBin, write_bins};
pub use border::{ArchivedBorder, Border, BorderBrick, decode_borders};
pub use brick::{
    ArchiveSize, ArchivedHitBrick, ArchivedSignBrick, BrickError, Crossing, HitBrick, HitEdge,
    MAX_HITS, NO_PLANE, PATCH, RecordBytes, SignBrick, SourcePlane, decode_hits, decode_signs,
    encode,
};
pub use cell_brick::{
    Above, ArchivedCellBrick, ArchivedFacePoint, CellBrick, FacePoint, Facet, MAX_LEVEL, NO_SOURCE,
    Summary, VertexReach, cluster_over, decode_cells,
};
pub use domain::{Domain, LATTICE_BITS, MIN_CELL_UNITS, SnapBox};
pub use edge_bits::{
    AXIS_EDGES, CORNER_ROW, CornerBits, EdgeBits, FaceBits, LINES, ROWS, SIDE, edge_index,
    edge_position,
};
pub use edge_brick::{ArchivedEdgeBrick, EdgeBrick, decode_edges};
pub use edge_walk::EdgeWalk;
pub use exposed::{BURIED, ExposedPlace, LOST, Touched};
pub use flips::{FLIPS, Flip, FlipReader, FlipRecord, Flips};
pub use index::{BrickIndex, Neighbour};
pub use key::BrickKey;
pub use lost::LostHits;
pub use occupancy::{InsideCorners, Occupancy};
pub use plane::clamp_to_edge;
pub use region::{FaceRegions, Regions, find_regions};
pub use sign_bricks::{AS_HIT, SignBricks, SignRecord, SignView};
pub use soup_edges::{BorderUse, MOST_USES, Panes, SoupEdges, TrianglePair, each_border};
pub use soup_spool::{NarrowTriangle, SoupBlock, SoupReader, SoupSpool, SoupWriter};
pub use touch::for_each_touched_brick;
pub use triangle::{
    AttributeRecord, BinTriangle, CLOSES, DropRecord, SoupTriangle, TRANSPARENT, surface_of,
};
