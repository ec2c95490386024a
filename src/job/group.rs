//! Which photographs were taken by the same camera, and which are copies.
//!
//! A calibration is about one camera at one size. Frames belong together where folder, size in stored pixels, EXIF camera
//! and the camera in the file name agree; the largest group is the one to calibrate, the rest is named.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use serde::{Deserialize, Serialize};

use super::photo::Exif;
use crate::calib::order;

/// What is known of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<'a> {
    /// Its path, as given or found; what tells two folders or cameras apart must be in it.
    pub name: &'a str,
    /// Size in stored pixels: a frame that EXIF rotates stays as it is stored.
    pub size_px: [u32; 2],
    /// What the file says.
    pub exif: &'a Exif,
    /// Whether it counts for the size of its group: pictures without a board calibrate nothing.
    pub counts: bool,
}

/// Frames of one camera.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    /// What tells it from the others: `1280x720`, `cam_1`, `left, 640x480`; `all` where there are no others.
    pub name: String,
    /// Why it is not part of the first group; empty for the first.
    pub reason: String,
    /// Positions in the list of frames, ascending.
    pub members: Vec<usize>,
    /// Who made the camera, where the files say.
    pub make: Option<String>,
    /// Its model, where the files say.
    pub model: Option<String>,
}

/// What must agree within a group.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    folder: String,
    label: String,
    camera: CameraId,
    size_px: [u32; 2],
}

/// Make, model and serial number.
type CameraId = [Option<String>; 3];

/// Groups of frames, the one with the most frames that count first, of these the largest; equally large ones in the order of
/// their first frames.
pub fn by_camera(frames: &[Candidate<'_>]) -> Vec<Group> {
    let labels = labels(frames);
    let mut keys: Vec<Key> = frames
        .iter()
        .zip(labels)
        .map(|(frame, label)| Key {
            folder: folder(frame.name),
            label,
            camera: [&frame.exif.make, &frame.exif.model, &frame.exif.serial].map(Clone::clone),
            size_px: frame.size_px,
        })
        .collect();
    complete_cameras(&mut keys);
    let mut groups: Vec<(Key, Vec<usize>)> = Vec::new();
    let mut position = BTreeMap::new();
    for (i, key) in keys.into_iter().enumerate() {
        let at = *position.entry(key.clone()).or_insert(groups.len());
        if at == groups.len() {
            groups.push((key, Vec::new()));
        }
        groups[at].1.push(i);
    }
    let counted = |g: &[usize]| g.iter().filter(|i| frames[**i].counts).count();
    order::by(&mut groups, |g| [counted(&g.1), g.1.len()].map(|n| -(n as f64)));
    let keys: Vec<Key> = groups.iter().map(|g| g.0.clone()).collect();
    groups
        .into_iter()
        .map(|(key, members)| {
            let (name, reason) = (name(&key, &keys), reason(&key, &keys[0]));
            let [make, model, _] = key.camera;
            Group { name, reason, members, make, model }
        })
        .collect()
}

/// For each frame the position of an earlier one with the same pixels (see [`super::photo::Picture::pixels_hash`]); `None` for
/// the first of its kind, and for a frame that could not be read.
pub fn duplicates(pixel_hashes: &[Option<u128>]) -> Vec<Option<usize>> {
    let mut first = BTreeMap::new();
    let earlier =
        |(i, hash): (usize, &Option<u128>)| Some(*first.entry((*hash)?).or_insert(i)).filter(|at| *at != i);
    pixel_hashes.iter().enumerate().map(earlier).collect()
}

fn folder(name: &str) -> String {
    Path::new(name).parent().map(|p| p.display().to_string()).unwrap_or_default()
}

/// A frame whose EXIF says less joins the only camera beside it that it does not contradict: editors strip tags.
fn complete_cameras(keys: &mut [Key]) {
    // As many as there are cameras, however many pictures.
    let known = order::set(keys.iter().cloned());
    for key in keys {
        let fits = |other: &CameraId| {
            *other != key.camera && key.camera.iter().zip(other).all(|(own, its)| own.is_none() || own == its)
        };
        let beside = known
            .iter()
            .filter(|k| (&k.folder, &k.label, k.size_px) == (&key.folder, &key.label, key.size_px));
        let candidates = order::set(beside.map(|k| &k.camera).filter(|c| fits(c)));
        // Of several, a partial one that itself fits into the fullest is no contradiction.
        let fullest = candidates.iter().max_by_key(|c| c.iter().flatten().count());
        if let Some(fullest) = fullest
            && candidates.iter().all(|c| c.iter().zip(fullest.iter()).all(|(a, b)| a.is_none() || a == b))
        {
            key.camera = (*fullest).clone();
        }
    }
}

/// The camera in the file name of each frame, empty where the name tells none.
fn labels(frames: &[Candidate<'_>]) -> Vec<String> {
    let stems: Vec<String> = frames
        .iter()
        .map(|f| {
            Path::new(f.name).file_stem().map(|s| s.to_string_lossy().to_lowercase()).unwrap_or_default()
        })
        .collect();
    let numbered: Vec<(String, String)> = stems.iter().map(|s| split_number(s)).collect();
    let mut by_folder: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (i, frame) in frames.iter().enumerate() {
        by_folder.entry(folder(frame.name)).or_default().push(i);
    }
    let mut labels = vec![String::new(); frames.len()];
    for members in by_folder.values() {
        let prefixes = parallel_prefixes(members.iter().map(|i| &numbered[*i]));
        for &i in members {
            if let Some(camera) = camera_token(&stems[i]) {
                labels[i] = camera;
            } else if prefixes.contains(&numbered[i].0) {
                labels[i] = numbered[i].0.trim_matches(|c: char| !c.is_alphanumeric()).to_owned();
            }
        }
    }
    labels
}

/// A name without its last run of digits, and that run.
fn split_number(stem: &str) -> (String, String) {
    let Some(last) = stem.rfind(|c: char| c.is_ascii_digit()) else {
        return (stem.to_owned(), String::new());
    };
    let first = stem[..last]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |i| i + stem[i..].chars().next().map_or(1, char::len_utf8));
    ([&stem[..first], &stem[last + 1..]].concat(), stem[first..=last].trim_start_matches('0').to_owned())
}

/// Prefixes that name cameras: two or more, each of at least two frames, that share most of their numbers
/// (`left01 left02 … right01 right02 …`); `IMG_0191 … DSC_0007` share none.
fn parallel_prefixes<'a>(names: impl Iterator<Item = &'a (String, String)>) -> BTreeSet<String> {
    let mut numbers: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (prefix, number) in names {
        numbers.entry(prefix).or_default().insert(number);
    }
    numbers.retain(|_, n| n.len() >= 2);
    let parallel = |a: &BTreeSet<&str>, b: &BTreeSet<&str>| {
        let shared = a.intersection(b).count();
        shared >= 2 && 2 * shared >= a.len().min(b.len())
    };
    let beside = |(prefix, n): &(&&str, &BTreeSet<&str>)| {
        numbers.iter().any(|(other, m)| other != *prefix && parallel(n, m))
    };
    order::set(numbers.iter().filter(beside).map(|(prefix, _)| (*prefix).to_owned()))
}

/// `cam_0` of `cam_0_frame_017`: the word cam or camera with a short number or letter, where the rest of the name numbers
/// the frame. (`camera_017` alone numbers frames of one camera.)
fn camera_token(stem: &str) -> Option<String> {
    for word in ["camera", "cam"] {
        for (start, _) in stem.match_indices(word) {
            if stem[..start].ends_with(|c: char| c.is_alphanumeric()) {
                continue;
            }
            let rest = &stem[start + word.len()..];
            let id = rest.trim_start_matches(['_', '-', ' ']);
            let digits = id.len() - id.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            let length = if digits > 0 { digits } else { id.chars().next().map_or(0, char::len_utf8) };
            let tail = &id[length..];
            if length == 0 || digits > 2 || tail.starts_with(|c: char| c.is_alphanumeric()) {
                continue;
            }
            let elsewhere = [&stem[..start], tail].concat();
            if elsewhere.contains(|c: char| c.is_ascii_digit()) {
                return Some(stem[start..stem.len() - tail.len()].to_owned());
            }
        }
    }
    None
}

fn camera_name(camera: &CameraId) -> String {
    let [make, model, serial] = camera;
    let model = model.as_deref().unwrap_or_default();
    // Many models begin with the make.
    let make = make.as_deref().filter(|m| !model.starts_with(*m)).unwrap_or_default();
    let serial = serial.as_ref().map(|s| format!("no. {s}")).unwrap_or_default();
    let name = [make, model, &serial].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join(" ");
    if name.is_empty() { "unknown camera".to_owned() } else { name }
}

fn size_name([w, h]: [u32; 2]) -> String {
    format!("{w}x{h}")
}

/// The facets of `key` that are not the same in all groups.
fn name(key: &Key, all: &[Key]) -> String {
    let mut parts = Vec::new();
    if all.iter().any(|k| k.folder != key.folder) {
        let last = |k: &Key| Path::new(&k.folder).file_name().map(|n| n.to_string_lossy().into_owned());
        // `a/photos` and `b/photos` need their whole paths: a name stands for one group.
        let alike = all.iter().any(|k| k.folder != key.folder && last(k) == last(key));
        parts.push(last(key).map_or_else(|| ".".to_owned(), |n| if alike { key.folder.clone() } else { n }));
    }
    if all.iter().any(|k| k.label != key.label) {
        parts.push(if key.label.is_empty() { "other names".to_owned() } else { key.label.clone() });
    }
    if all.iter().any(|k| k.camera != key.camera) {
        parts.push(camera_name(&key.camera));
    }
    if all.iter().any(|k| k.size_px != key.size_px) {
        parts.push(size_name(key.size_px));
    }
    if parts.is_empty() { "all".to_owned() } else { parts.join(", ") }
}

fn reason(key: &Key, first: &Key) -> String {
    let mut reasons = Vec::new();
    if key.folder != first.folder {
        reasons.push("in another folder".to_owned());
    }
    if key.label != first.label {
        reasons.push("another camera by the file names".to_owned());
    }
    if key.camera != first.camera {
        reasons.push(format!("taken by {}, not {}", camera_name(&key.camera), camera_name(&first.camera)));
    }
    if key.size_px != first.size_px {
        reasons.push(format!("{} px, not {}", size_name(key.size_px), size_name(first.size_px)));
    }
    reasons.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::photo;

    fn grouped(frames: &[(&str, [u32; 2], Exif)]) -> Vec<(String, String, usize)> {
        let members: Vec<_> = frames
            .iter()
            .map(|(path, size_px, exif)| Candidate { name: path, size_px: *size_px, exif, counts: true })
            .collect();
        by_camera(&members).into_iter().map(|g| (g.name, g.reason, g.members.len())).collect()
    }

    #[test]
    fn folders_of_one_name_are_two_groups_with_two_names() {
        let paths = ["a/photos/01.jpg", "a/photos/02.jpg", "b/photos/01.jpg", "c/02.jpg"];
        let told = names(&paths);
        assert_eq!(told, [("a/photos".to_owned(), 2), ("b/photos".to_owned(), 1), ("c".to_owned(), 1)]);
    }

    fn names(paths: &[&str]) -> Vec<(String, usize)> {
        let frames: Vec<_> = paths.iter().map(|p| (*p, [640, 480], Exif::default())).collect();
        grouped(&frames).into_iter().map(|(name, _, n)| (name, n)).collect()
    }

    fn one(name: &str, n: usize) -> (String, usize) {
        (name.to_owned(), n)
    }

    #[test]
    fn numbering_alone_never_splits() {
        for set in [
            &["left01.jpg", "left02.jpg", "left11.jpg"][..],
            &["IMG_0191.jpg", "IMG_0194.jpg", "DSC0007.jpg", "DSC0008.jpg"],
            &["img0.png", "img113.png", "euroc.png"],
            &["camera_001.png", "camera_002.png", "camera_003.png"],
            &["20240501_120000.jpg", "20240501_120013.jpg", "20240502_090000.jpg"],
            &["a.png", "b.png"],
        ] {
            assert_eq!(names(set), [one("all", set.len())]);
        }
    }

    #[test]
    fn cameras_in_file_names_split() {
        assert_eq!(
            names(&[
                "cam_0_frame_000.jpg",
                "cam_0_frame_100.jpg",
                "cam_1_frame_100.jpg",
                "cam_2_frame_100.jpg"
            ]),
            [one("cam_0", 2), one("cam_1", 1), one("cam_2", 1)]
        );
        assert_eq!(
            names(&["cam0_0000.jpg", "cam0_0006.jpg", "cam1_0000.jpg", "cam1_0006.jpg", "cam1_0012.jpg"]),
            [one("cam1", 3), one("cam0", 2)]
        );
        assert_eq!(
            names(&["left01.jpg", "left02.jpg", "left03.jpg", "right01.jpg", "right02.jpg", "notes.jpg"]),
            [one("left", 3), one("right", 2), one("other names", 1)]
        );
        assert_eq!(
            names(&["01_camera_a.jpg", "02_camera_a.jpg", "01_camera_b.jpg"]),
            [one("camera_a", 2), one("camera_b", 1)]
        );
    }

    #[test]
    fn folders_sizes_and_cameras_split() {
        assert_eq!(
            names(&["set/left/01.png", "set/left/02.png", "set/right/01.png"]),
            [one("left", 2), one("right", 1)]
        );
        let [a, b] = ["iPhone 6", "iPhone 7"].map(|model| Exif {
            make: Some("Apple".into()),
            model: Some(model.into()),
            ..Exif::default()
        });
        let none = Exif::default();
        let size = [1280, 720];
        assert_eq!(
            grouped(&[
                ("1.jpg", [720, 1280], none.clone()),
                ("2.jpg", size, none.clone()),
                ("3.jpg", size, none.clone())
            ]),
            [
                ("1280x720".to_owned(), String::new(), 2),
                ("720x1280".to_owned(), "720x1280 px, not 1280x720".to_owned(), 1)
            ]
        );
        // A frame without EXIF joins the only camera, but not one of two.
        assert_eq!(
            grouped(&[("1.jpg", size, a.clone()), ("2.jpg", size, none.clone())]),
            [("all".to_owned(), String::new(), 2)]
        );
        let groups = grouped(&[
            ("1.jpg", size, a.clone()),
            ("2.jpg", size, none),
            ("3.jpg", size, b),
            ("4.jpg", size, a),
        ]);
        assert_eq!(
            groups.iter().map(|g| (&*g.0, g.2)).collect::<Vec<_>>(),
            [("Apple iPhone 6", 2), ("unknown camera", 1), ("Apple iPhone 7", 1)]
        );
        assert_eq!(groups[2].1, "taken by Apple iPhone 7, not Apple iPhone 6");
    }

    #[test]
    fn numbers_are_split_off_names() {
        for (stem, prefix, number) in [
            ("left01", "left", "1"),
            ("01_left", "_left", "1"),
            ("ä7", "ä", "7"),
            ("none", "none", ""),
            ("42", "", "42"),
        ] {
            assert_eq!(split_number(stem), (prefix.to_owned(), number.to_owned()));
        }
    }

    #[test]
    fn copies_point_to_the_first() {
        let hashes = [Some(5), Some(7), Some(5), None, Some(9), None, Some(7), Some(5)];
        assert_eq!(duplicates(&hashes), [None, None, Some(0), None, None, None, Some(1), Some(0)]);
    }

    #[test]
    fn real_sets_are_grouped() {
        let root = std::env::var_os("STRAIGHTEDGE_DATA")
            .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), Into::into);
        if !root.is_dir() {
            println!("skipped: no photographs at {}", root.display());
            return;
        }
        for (set, expected) in [
            ("opencv_left", &[("all", 13)][..]),
            ("camodocal_fisheye", &[("all", 11)]),
            ("udacity_lane", &[("1280x720", 18), ("1281x721", 2)]),
            ("caliscope_chess", &[("cam_0", 5), ("cam_1", 1), ("cam_2", 1), ("cam_3", 1)]),
            ("caliscope_charuco", &[("cam0", 19), ("cam1", 19)]),
            ("learning_opencv_phone", &[("1600x1200", 7), ("1200x1600", 1)]),
        ] {
            let files = photo::list(&[root.join(set)]).unwrap();
            let pictures: Vec<_> =
                files.iter().map(|f| photo::read(f, photo::Colours::Gray).unwrap()).collect();
            let names: Vec<_> = files.iter().map(|f| f.display().to_string()).collect();
            let members: Vec<_> = names
                .iter()
                .zip(&pictures)
                .map(|(name, p)| Candidate {
                    name,
                    size_px: [p.photo.width as u32, p.photo.height as u32],
                    exif: &p.exif,
                    counts: true,
                })
                .collect();
            let groups = by_camera(&members);
            let found: Vec<_> = groups.iter().map(|g| (g.name.as_str(), g.members.len())).collect();
            assert_eq!(found, expected, "{set}");
            let hashes: Vec<_> = pictures.iter().map(|p| Some(p.pixels_hash)).collect();
            assert!(duplicates(&hashes).iter().all(Option::is_none), "{set}");
        }
    }
}
