//! Dictionaries of square markers: which code is which id.
//!
//! A code is `cells`² bits, rows from the top, the first bit highest, 1 for white, as the marker is printed the right way up. The
//! table is made from OpenCV's predefined dictionaries (`assets/dictionaries/README.md`); S. Garrido-Jurado et al.,
//! "Automatic generation and detection of highly reliable fiducial markers under occlusion", Pattern Recognition 47(6), 2014;
//! E. Olson, "AprilTag: A robust and flexible visual fiducial system", ICRA 2011.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

use crate::{Error, Result};

static CODES: &[u8] = include_bytes!("../../../assets/dictionaries/codes.bin");

/// What is known of a dictionary.
struct Spec {
    name: &'static str,
    cells: u8,
    len: u32,
    /// Smallest number of bits in which two codes, or a code and itself, differ over all four rotations.
    distance: u8,
    /// Where its codes begin in the table, bytes; `None` where a rule makes them.
    first: Option<usize>,
}

const fn spec(name: &'static str, cells: u8, len: u32, distance: u8, first: usize) -> Spec {
    Spec { name, cells, len, distance, first: Some(first) }
}

static SPECS: [Spec; 22] = [
    spec("4x4_50", 4, 50, 4, 0),
    spec("4x4_100", 4, 100, 3, 0),
    spec("4x4_250", 4, 250, 3, 0),
    spec("4x4_1000", 4, 1000, 2, 0),
    spec("5x5_50", 5, 50, 8, 2000),
    spec("5x5_100", 5, 100, 7, 2000),
    spec("5x5_250", 5, 250, 6, 2000),
    spec("5x5_1000", 5, 1000, 5, 2000),
    spec("6x6_50", 6, 50, 13, 5125),
    spec("6x6_100", 6, 100, 12, 5125),
    spec("6x6_250", 6, 250, 11, 5125),
    spec("6x6_1000", 6, 1000, 9, 5125),
    spec("7x7_50", 7, 50, 19, 9625),
    spec("7x7_100", 7, 100, 18, 9625),
    spec("7x7_250", 7, 250, 17, 9625),
    spec("7x7_1000", 7, 1000, 14, 9625),
    Spec { name: "original", cells: 5, len: 1024, distance: 0, first: None },
    spec("16h5", 4, 30, 5, 15750),
    spec("25h9", 5, 35, 9, 15810),
    spec("36h10", 6, 2320, 10, 15920),
    spec("36h11", 6, 587, 11, 26360),
    spec("mip_36h12", 6, 250, 12, 29002),
];

/// Most that a code made of chance may pass for one of the dictionary.
const CHANCE: f64 = 1e-3;

/// A dictionary; its name is what people write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Dictionary(u8);

/// A code that was recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Number of the code in its dictionary.
    pub id: u32,
    /// Quarter turns: corner `turns` of the mark is the upper left one of the print, and so on clockwise.
    pub turns: u8,
    /// Bits that were read differently, those in doubt left out.
    pub errors: u8,
}

/// Bits of a marker as they were read, in the order of a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bits {
    /// Cells along a side, without the border.
    pub cells: u8,
    /// The code: `cells`² bits.
    pub code: u64,
    /// Bits that could be read either way.
    pub doubt: u64,
}

impl Bits {
    /// The same a quarter turn on: what is read from the next corner (clockwise).
    pub fn turned(self) -> Self {
        let n = usize::from(self.cells);
        // Seen from the upper right corner, x runs down and y to the left.
        let turn = |bits: u64| rearranged(bits, n, |r, c| (c, n - 1 - r));
        Self { code: turn(self.code), doubt: turn(self.doubt), ..self }
    }

    /// The same seen from behind, left and right exchanged.
    pub fn mirrored(self) -> Self {
        let n = usize::from(self.cells);
        let flip = |bits: u64| rearranged(bits, n, |r, c| (r, n - 1 - c));
        Self { code: flip(self.code), doubt: flip(self.doubt), ..self }
    }
}

/// Bit (r, c) of the answer is bit `from(r, c)` of `bits`.
fn rearranged(bits: u64, n: usize, from: impl Fn(usize, usize) -> (usize, usize)) -> u64 {
    let at = |(r, c): (usize, usize)| bits >> ((n * n - 1).saturating_sub(r * n + c)) & 1;
    (0..n).flat_map(|r| (0..n).map(move |c| (r, c))).fold(0, |out, (r, c)| out << 1 | at(from(r, c)))
}

impl Dictionary {
    /// All dictionaries.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..SPECS.len() as u8).map(Self)
    }

    /// The dictionaries that hold all others.
    pub(super) fn families() -> impl Iterator<Item = Self> {
        let shares = |a: &Spec, b: &Spec| a.first.is_some() && a.first == b.first && a.len < b.len;
        Self::all().filter(move |d| !SPECS.iter().any(|s| shares(d.spec(), s)))
    }

    /// Whether both number the same markers: one is a part of the other.
    pub fn is_kin_of(self, other: Self) -> bool {
        self.cells() == other.cells() && self.code(0) == other.code(0)
    }

    /// Whether any dictionary has such a code, as it is or mirrored.
    pub(super) fn any_has(bits: Bits) -> bool {
        Self::families().any(|d| d.nearest(bits).is_some() || d.nearest(bits.mirrored()).is_some())
    }

    fn spec(self) -> &'static Spec {
        &SPECS[usize::from(self.0) % SPECS.len()]
    }

    /// Name on the command line: `4x4_50`, `36h11`, …
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// Cells along a side, without the border.
    pub fn cells(self) -> u8 {
        self.spec().cells
    }

    /// Number of ids.
    pub fn len(self) -> u32 {
        self.spec().len
    }

    /// Never.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Wrong bits that can be corrected at most without taking one code for another: half the distance of two codes.
    pub fn capacity(self) -> u8 {
        self.spec().distance.saturating_sub(1) / 2
    }

    /// Wrong bits that are corrected: at most half the capacity, and few enough that chance seldom passes for a code.
    pub fn corrected(self) -> u8 {
        (1..=self.capacity() / 2).take_while(|e| self.chance(*e) <= CHANCE).last().unwrap_or(0)
    }

    /// How often a code made of chance passes for one of the dictionary where up to `errors` bits are corrected.
    pub fn chance(self, errors: u8) -> f64 {
        let n = f64::from(self.cells()).powi(2);
        let (mut ways, mut sum) = (1.0, 0.0);
        for k in 0..=errors {
            sum += ways;
            ways *= (n - f64::from(k)) / (f64::from(k) + 1.0);
        }
        4.0 * f64::from(self.len()) * sum / n.exp2()
    }

    /// The code of an id, `cells`² bits; `None` where there is no such id.
    pub fn code(self, id: u32) -> Option<u64> {
        let spec = self.spec();
        (id < spec.len).then_some(())?;
        let n = usize::from(spec.cells) * usize::from(spec.cells);
        let Some(first) = spec.first else { return Some(original(id)) };
        let bit = 8 * first + id as usize * n;
        // 49 bits that begin anywhere in a byte lie in eight bytes.
        let word = (0..8).fold(0u64, |w, k| w << 8 | u64::from(*CODES.get(bit / 8 + k).unwrap_or(&0)));
        Some(word << (bit % 8) >> (64 - n))
    }

    /// The id of a code that was read, in any of four rotations. `None` where too many bits are wrong or in doubt, or where two
    /// ids are equally near.
    pub fn identify(self, bits: Bits) -> Option<Identity> {
        let nearest = self.nearest(bits)?;
        (nearest.errors <= self.corrected()).then_some(nearest)
    }

    /// [`Self::identify`] with as many corrections as the codes allow: for a marker whose place says which id it should be.
    pub fn nearest(self, bits: Bits) -> Option<Identity> {
        let spec = self.spec();
        if bits.cells != spec.cells {
            return None;
        }
        let in_doubt = bits.doubt.count_ones();
        let room = u32::from(spec.distance.saturating_sub(1)).checked_sub(in_doubt)? / 2;
        let mut best: Option<Identity> = None;
        let mut ways = 0;
        let mut turned = [bits; 4];
        for k in 1..4 {
            turned[k] = turned[k - 1].turned();
        }
        for id in 0..spec.len {
            let Some(code) = self.code(id) else { break };
            for (turns, turned) in (0..).zip(&turned) {
                let errors = ((code ^ turned.code) & !turned.doubt).count_ones();
                if errors > room || best.is_some_and(|b| errors > u32::from(b.errors)) {
                    continue;
                }
                ways = if best.is_some_and(|b| errors == u32::from(b.errors)) { ways + 1 } else { 1 };
                best = Some(Identity { id, turns, errors: errors as u8 });
            }
        }
        best.filter(|_| ways == 1)
    }
}

/// Code of the first ArUco library: each row of five bits is one of four words that carry two bits of the id.
fn original(id: u32) -> u64 {
    const WORDS: [u64; 4] = [0b10000, 0b10111, 0b01001, 0b01110];
    (0..5).fold(0, |code, row| code << 5 | WORDS[(id >> (8 - 2 * row) & 3) as usize])
}

impl fmt::Display for Dictionary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Dictionary {
    type Err = Error;

    /// Also reads OpenCV's names: `DICT_4X4_50`, `DICT_APRILTAG_36h11`, `tag36h11`.
    fn from_str(text: &str) -> Result<Self> {
        let lower = text.trim().to_lowercase();
        let mut short = lower.as_str();
        for prefix in ["dict_", "apriltag_", "aruco_", "apriltag", "tag"] {
            short = short.strip_prefix(prefix).unwrap_or(short);
        }
        let short = short.trim_start_matches('_');
        Self::all().find(|d| d.name() == short || (short == "36h12" && d.name() == "mip_36h12")).ok_or_else(
            || {
                let names: Vec<_> = Self::all().map(Self::name).collect();
                Error::Invalid(format!("\"{text}\" is not a dictionary: choose one of {}", names.join(", ")))
            },
        )
    }
}

impl From<Dictionary> for String {
    fn from(dictionary: Dictionary) -> Self {
        dictionary.name().to_owned()
    }
}

impl TryFrom<String> for Dictionary {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(d: Dictionary, code: u64) -> Bits {
        Bits { cells: d.cells(), code, doubt: 0 }
    }

    #[test]
    fn every_id_is_recognised_in_every_rotation() {
        for d in Dictionary::all() {
            let step = (d.len() / 60).max(1);
            for id in (0..d.len()).step_by(step as usize) {
                let mut read = bits(d, d.code(id).unwrap());
                let symmetric = read.code == read.turned().turned().code;
                for back in [0, 3, 2, 1] {
                    let want = Identity { id, turns: back, errors: 0 };
                    let got = d.identify(read);
                    assert!(got == Some(want) || (symmetric && got.is_none()), "{d} {id} {back} {got:?}");
                    read = read.turned();
                }
            }
            assert_eq!(d.code(d.len()), None);
            assert_eq!(d.name().parse::<Dictionary>().unwrap(), d);
        }
    }

    #[test]
    fn the_distances_are_true() {
        for d in Dictionary::all().filter(|d| d.len() <= 250) {
            let codes: Vec<[u64; 4]> = (0..d.len())
                .map(|id| {
                    let mut b = bits(d, d.code(id).unwrap());
                    std::array::from_fn(|_| {
                        let code = b.code;
                        b = b.turned();
                        code
                    })
                })
                .collect();
            let pairs = codes.iter().enumerate().flat_map(|(i, a)| {
                codes.iter().enumerate().flat_map(move |(j, b)| {
                    let from = usize::from(i == j);
                    b[from..].iter().map(move |b| (a[0] ^ b).count_ones())
                })
            });
            assert_eq!(pairs.min(), Some(u32::from(SPECS[usize::from(d.0)].distance)), "{d}");
        }
    }

    #[test]
    fn wrong_bits_are_corrected_within_a_strict_limit() {
        let d: Dictionary = "36h11".parse().unwrap();
        let code = d.code(17).unwrap();
        assert_eq!((d.capacity(), d.corrected()), (5, 2));
        assert_eq!(d.identify(bits(d, code ^ 0b1010_0000)).map(|i| (i.id, i.errors)), Some((17, 2)));
        assert_eq!(d.identify(bits(d, code ^ 0b1010_0100)), None);
        assert_eq!(d.nearest(bits(d, code ^ 0b1010_0100)).map(|i| (i.id, i.errors)), Some((17, 3)));
        // What is in doubt is no error, but takes room.
        let doubt = Bits { doubt: 0b11, ..bits(d, code ^ 0b11) };
        assert_eq!(d.identify(doubt).map(|i| (i.id, i.errors)), Some((17, 0)));
        assert_eq!(d.identify(Bits { doubt: 0xfff, ..bits(d, code) }), None);
        let four: Dictionary = "DICT_4X4_50".parse().unwrap();
        assert_eq!(four.corrected(), 0);
        assert_eq!(four.identify(bits(four, four.code(3).unwrap() ^ 1)), None);
    }

    #[test]
    fn mirrored_codes_are_no_codes() {
        let d: Dictionary = "apriltag_36h11".parse().unwrap();
        for id in 0..d.len() {
            assert_eq!(d.identify(bits(d, d.code(id).unwrap()).mirrored()), None, "{id}");
        }
        let b = bits(d, d.code(5).unwrap());
        assert_eq!(b.mirrored().mirrored(), b);
    }
}
