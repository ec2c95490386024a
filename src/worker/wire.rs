//! Requests and replies as bytes, between a page and its workers.
//!
//! The length of a JSON text in four bytes, the text, and after it the pixels or bytes of a file that the message carries
//! ([`Bulk`]): as numbers in a text they would take a second.

use serde::{Serialize, de::DeserializeOwned};

use crate::{
    calib::{Error, Result, json},
    job::{Output, Reply, Request},
};

/// What may carry many bytes.
pub(crate) trait Bulk {
    /// These bytes, where it has any.
    fn bulk(&mut self) -> Option<&mut Vec<u8>>;
}

impl Bulk for Request {
    fn bulk(&mut self) -> Option<&mut Vec<u8>> {
        None
    }
}

impl Bulk for Option<Reply> {
    fn bulk(&mut self) -> Option<&mut Vec<u8>> {
        match self.as_mut()?.result.as_mut().ok()? {
            Output::Raster(raster) | Output::Straight(raster, _) => Some(&mut raster.data),
            Output::Inspection(inspection) => inspection.thumbnail.as_mut().map(|t| &mut t.data),
            Output::File(bytes) => Some(bytes),
            Output::Evidence(_)
            | Output::Effect(_)
            | Output::Compared(_)
            | Output::Validity(_)
            | Output::Advice(_)
            | Output::Twin(_) => None,
        }
    }
}

/// As bytes; numbers come back as they were, bit by bit; poses, which are written as rotation vectors, to the last digit.
///
/// # Errors
/// [`Error::Crashed`] for what has no such form; there is nothing of that kind in a request or a reply.
pub(crate) fn to_bytes<T: Serialize + Bulk>(mut value: T) -> Result<Vec<u8>> {
    let bulk = value.bulk().map(std::mem::take).unwrap_or_default();
    let mut bytes = vec![0; 4];
    serde_json::to_writer(&mut bytes, &value)
        .map_err(|e| Error::Crashed(format!("a message could not be written ({e})")))?;
    let length = (bytes.len() - 4) as u32;
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    bytes.extend(bulk);
    Ok(bytes)
}

/// Back from bytes.
///
/// # Errors
/// [`Error::Crashed`] for other bytes.
pub(crate) fn from_bytes<T: DeserializeOwned + Bulk>(bytes: &[u8]) -> Result<T> {
    let wrong = |why: String| Error::Crashed(format!("a message could not be read ({why})"));
    let cut = || wrong("it is cut short".to_owned());
    let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(cut)?;
    let (text, bulk) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(cut)?;
    let text = std::str::from_utf8(text).map_err(|e| wrong(e.to_string()))?;
    let mut value: T = json::read(text).map_err(|e| wrong(e.to_string()))?;
    if let Some(place) = value.bulk() {
        *place = bulk.to_vec();
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use std::{fmt::Debug, ops::ControlFlow, sync::Arc};

    use super::*;
    use crate::{
        calib::{detect, pose::Pose, report::Settings, synth::Scene, undistort::Framing},
        job::{Job, Key, Output, Reply, Request, Source, assemble::Entry, evidence::Case, run},
    };

    fn travels<T: Serialize + DeserializeOwned + Bulk + Clone + PartialEq + Debug>(value: &T) {
        assert_eq!(from_bytes::<T>(&to_bytes(value.clone()).unwrap()).unwrap(), *value);
    }

    /// A pose is written as a rotation vector: its matrix comes back to the last digit, not to the last bit.
    fn without_poses(mut reply: Option<Reply>) -> Option<Reply> {
        if let Some(Reply { result: Ok(Output::Evidence(evidence)), .. }) = &mut reply {
            let views = &mut evidence.calibration.as_mut().unwrap().views;
            assert!(views.iter().all(|v| v.camera_from_board.translation.z > 0.0));
            views.iter_mut().for_each(|v| v.camera_from_board = Pose::identity());
        }
        reply
    }

    /// What a job answers; both went over the wire.
    fn answer(job: Job) -> Output {
        let request = Request { key: Key(u128::MAX - 5), job };
        travels(&request);
        let reply: Option<Reply> = run(request, &mut |_| ControlFlow::Continue(()));
        let there = from_bytes::<Option<Reply>>(&to_bytes(reply.clone()).unwrap()).unwrap();
        assert_eq!(without_poses(there), without_poses(reply.clone()));
        reply.unwrap().result.unwrap()
    }

    #[test]
    fn every_number_of_requests_and_replies_comes_back() {
        let scene = Arc::new(Scene::seed());
        let source = |view| Source::View { scene: scene.clone(), view };
        let options = detect::Options::default();
        let entries: Vec<Entry> = (0..4)
            .map(|view| {
                let Output::Inspection(seen) =
                    answer(Job::Inspect { source: source(view), options, thumbnail_px: 32 })
                else {
                    panic!("no inspection")
                };
                Entry::inspected(view.to_string(), Ok(*seen))
            })
            .collect();
        let Output::Evidence(evidence) =
            answer(Job::Evidence(Box::new(Case::new(entries, Settings::default()))))
        else {
            panic!("no evidence")
        };
        let camera = evidence.calibration.unwrap().camera;
        answer(Job::Look { source: source(0) });
        answer(Job::Straighten { source: source(0), camera, framing: Framing::flat(0.5) });
        let missing = Job::Thumbnail { source: Source::File("no/such".into()), longest_px: 9 };
        travels(&run(Request { key: Key(1), job: missing }, &mut |_| ControlFlow::Continue(())));
    }

    #[test]
    fn other_bytes_are_an_error() {
        assert!(matches!(from_bytes::<Request>(b"\x02\0\0\0{}"), Err(Error::Crashed(_))));
        assert!(matches!(from_bytes::<Request>(b"\x02\0\0\0"), Err(Error::Crashed(_))));
    }
}
