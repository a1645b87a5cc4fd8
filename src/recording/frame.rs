//! In: one entry of `frames` in meta.json. Out: the pictures taken then, with their pose, board and count.
//! Frame and unit: indices; counts in the unit of the recording's motion.

use super::taken::Taken;

/// One moment of the recording: pictures taken without moving.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRef {
    /// File name of the picture with the laser on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser: Option<String>,
    /// File names of the pictures of the same pose with the longer exposures, in the order of `exposures_us`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub longer: Vec<String>,
    /// File name of the picture with the laser off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient: Option<String>,
    /// Index into the pose file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<usize>,
    /// Index into `boards`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<usize>,
    /// Position of the axis, in `motion.unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<f64>,
    /// Number of the pulse that triggered the camera, from 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trigger: Option<u64>,
    /// Acquisition data of the frame, written by a recorder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken: Option<Taken>,
}

impl FrameRef {
    /// File names of the pictures with the laser on, the shortest exposure first.
    pub fn lasers(&self) -> Vec<String> {
        self.laser.iter().chain(&self.longer).cloned().collect()
    }
}
