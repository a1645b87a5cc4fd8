//! In: the name of a recording in a request, or none; the recordings of the screen. Out: the recording that is taken.
//! Frame and unit: none.

use crate::web::guard::resolve;
use crate::web::message::{RecordingInfo, Target};
use crate::web::work::Place;
use sheetlight::fault::Result;
use sheetlight::station::socket::words;

/// Each target in registers and on the screen.
const TARGETS: [(words::Target, Target); 5] = [
    (words::Target::Camera, Target::Camera),
    (words::Target::HandEye, Target::HandEye),
    (words::Target::LaserPlane, Target::LaserPlane),
    (words::Target::Pointer, Target::Pointer),
    (words::Target::Axis, Target::Axis),
];

/// The screen's target.
pub(super) fn target(of: words::Target) -> Target {
    TARGETS[of as usize - 1].1
}

/// The registers' target.
pub(super) fn target_shown(of: Target) -> Option<words::Target> {
    TARGETS.iter().find(|(_, screen)| *screen == of).map(|(shown, _)| *shown)
}

/// Whether the page Scan offers a recording.
pub(super) fn of_laser(r: &RecordingInfo) -> bool {
    r.beam.as_deref() != Some("pointer") && !r.board
}

/// Whether the page Calibrate offers a recording for a target.
pub(super) fn of_target(r: &RecordingInfo, target: Target) -> bool {
    let beam = r.beam.as_deref();
    r.board
        && match target {
            Target::Camera => true,
            Target::HandEye => beam.is_none(),
            Target::LaserPlane => beam != Some("pointer"),
            Target::Pointer => beam != Some("line"),
            Target::Axis => r.motion != "robot",
        }
}

/// The named recording, or the newest one that suits; `what` says which is wanted.
///
/// # Errors
/// The name is invalid, leads out of the folder, or names no recording. Without a name: no recording suits.
pub(super) fn taken(
    place: &Place,
    name: Option<String>,
    suits: impl Fn(&RecordingInfo) -> bool,
    what: &str,
) -> Result<String> {
    match name {
        Some(name) => resolve(&place.recordings, &name).map(|_| name),
        None => place.newest(suits, what),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_the_same_here_and_there() {
        for of in words::Target::ALL {
            assert_eq!(target_shown(target(of)), Some(of));
        }
    }

    /// An empty name takes what the pages offer, and nothing else.
    #[test]
    fn what_suits_is_what_the_pages_offer() {
        let of = |beam: Option<&str>, board, motion: &str| RecordingInfo {
            name: "a".into(),
            set: "a".into(),
            frames: 1,
            width: 1,
            height: 1,
            beam: beam.map(str::to_owned),
            board,
            motion: motion.into(),
            problem: None,
        };
        use Target::{Axis, Camera, HandEye, LaserPlane, Pointer};
        let all = [Camera, HandEye, LaserPlane, Pointer, Axis];
        let suit = |r: &RecordingInfo| all.map(|t| of_target(r, t));
        let room = of(None, true, "robot");
        assert_eq!((of_laser(&room), suit(&room)), (false, [true, true, true, true, false]));
        let line = of(Some("line"), true, "robot");
        assert_eq!((of_laser(&line), suit(&line)), (false, [true, false, true, false, false]));
        let pointer = of(Some("pointer"), true, "turntable");
        assert_eq!((of_laser(&pointer), suit(&pointer)), (false, [true, false, false, true, true]));
        let part = of(Some("line"), false, "linear");
        assert_eq!((of_laser(&part), suit(&part)), (true, [false; 5]));
        assert!(!of_laser(&of(Some("pointer"), false, "robot")));
    }
}
