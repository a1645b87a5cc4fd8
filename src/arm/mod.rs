//! In: where a robot's controller is (a URI). Out: its state, its pose with the time it was read, moves that were allowed.
//! One trait for all links.
//! Frame and unit: poses base_from_flange; mm, radians.
