//! In: the name of a recording in a request, or none; the recordings of the screen. Out: the recording that is taken.
//! Frame and unit: none.

use crate::procedure::calibrate::Target;
use crate::web::guard::resolve;
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

/// The named recording, or the newest one that suits a procedure, which is named as [`suits`] names it; `what` says
/// which is wanted.
///
/// [`suits`]: crate::procedure::suits
///
/// # Errors
/// The name is invalid, leads out of the folder, or names no recording. Without a name: no recording suits.
pub(super) fn taken(place: &Place, name: Option<String>, procedure: &str, what: &str) -> Result<String> {
    match name {
        Some(name) => resolve(&place.recordings, &name).map(|_| name),
        None => place.newest(|r| r.suits.iter().any(|suited| suited == procedure), what),
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
}
