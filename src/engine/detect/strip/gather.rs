//! Pixels across an edge, copied out of the picture once per stage.

use crate::image::{Plane, Sample};

use super::{
    edge::Edge,
    lanes::{Block, LANES},
};

/// Longest arm in rows.
pub(super) const LONGEST: i32 = 31;
/// Blocks of eight pixels in a row at most.
pub(super) const MAX_BLOCKS: usize = 4;
const ROWS: usize = 2 * LONGEST as usize + 2;

/// Rows of `8 · blocks` consecutive pixels along u, centred on an edge; v is constant in a row.
pub(super) struct Strip {
    /// Rows in use.
    pub(super) rows: usize,
    /// Blocks in a row.
    pub(super) blocks: usize,
    /// v of each row, relative to the corner's whole pixel.
    pub(super) v: [f32; ROWS],
    /// u of the first pixel of each row.
    pub(super) u0: [f32; ROWS],
    pixels: [Block; ROWS * MAX_BLOCKS],
}

/// Which pixels [`Strip::gather`] takes.
pub(super) struct Extent {
    /// Rows before and after the corner.
    pub(super) rows: [f32; 2],
    /// Blocks of eight pixels in a row.
    pub(super) blocks: usize,
    /// How far a row may slide towards smaller and larger u to stay in the picture, px.
    pub(super) slide: [f32; 2],
    /// Every n-th row.
    pub(super) every: i32,
    /// Farthest from the edge along u that pixels show nothing but its two squares, px.
    pub(super) clear: f32,
}

impl Strip {
    pub(super) const fn new() -> Self {
        Self {
            rows: 0,
            blocks: 1,
            v: [0.0; ROWS],
            u0: [0.0; ROWS],
            pixels: [[0.0; LANES]; ROWS * MAX_BLOCKS],
        }
    }

    /// Pixels of row `i`.
    pub(super) fn row(&self, i: usize) -> &[Block] {
        &self.pixels[i * self.blocks..(i + 1) * self.blocks]
    }

    /// Copies the pixels around `edge`, whose coordinates are relative to the pixel `origin`.
    ///
    /// Near the picture's border a row slides inwards by up to `slide`; a row that would slide further or lies outside is
    /// left out.
    pub(super) fn gather<T: Sample>(
        &mut self,
        picture: &Plane<T>,
        origin: [i32; 2],
        edge: &Edge,
        extent: &Extent,
    ) {
        let (size, step) = ([picture.width() as i32, picture.height() as i32], [1, picture.width()]);
        let (u, v) = if edge.steep { (0, 1) } else { (1, 0) };
        let lanes = (LANES * extent.blocks) as i32;
        let [before, after] = extent.rows.map(|r| r.min(LONGEST as f32) as i32);
        let every = if before + after < 14 { 1 } else { extent.every };
        self.blocks = extent.blocks;
        self.rows = 0;
        for row in (-before..=after).step_by(every as usize) {
            let centred = edge.u(row as f32) - 0.5 * (lanes - 1) as f32;
            let first = (centred + 10_000.5) as i32 - 10_000; // rounded without a call into libm
            let (abs_u, abs_v) = (origin[u] + first, origin[v] + row);
            let inside = abs_u.min(size[u] - lanes).max(0);
            let slide = inside - abs_u;
            let too_far = slide as f32 > extent.slide[1] || -slide as f32 > extent.slide[0];
            if abs_v < 0 || abs_v >= size[v] || inside + lanes > size[u] || too_far {
                continue;
            }
            let start = abs_v as usize * step[v] + inside as usize * step[u];
            let samples = &picture.data()[start..start + (lanes as usize - 1) * step[u] + 1];
            let blocks = &mut self.pixels[self.rows * self.blocks..(self.rows + 1) * self.blocks];
            if edge.steep {
                for (to, from) in blocks.iter_mut().zip(samples.chunks_exact(LANES)) {
                    for l in 0..LANES {
                        to[l] = from[l].to_f32();
                    }
                }
            } else {
                for (b, to) in blocks.iter_mut().enumerate() {
                    for l in 0..LANES {
                        to[l] = samples[(b * LANES + l) * step[u]].to_f32();
                    }
                }
            }
            let u0 = (first + slide) as f32;
            if extent.clear < (lanes / 2) as f32 {
                level_out(blocks, edge.u(row as f32) - u0, extent.clear);
            }
            self.v[self.rows] = row as f32;
            self.u0[self.rows] = u0;
            self.rows += 1;
        }
    }
}

/// Continues the last pixels within `clear` of the edge, which crosses at lane `centre`, to both ends of a row.
fn level_out(blocks: &mut [Block], centre: f32, clear: f32) {
    let last = blocks.len() * LANES - 1;
    let lane = |u: f32| (u.max(0.0) as usize).min(last);
    let (from, to) = (lane((centre - clear).ceil()), lane(centre + clear));
    let pixels = blocks.as_flattened_mut();
    let (first, end) = (pixels[from], pixels[to]);
    pixels[..from].fill(first);
    pixels[to..].fill(end);
}
