//! In: the table `[outputs]` of station.toml. Out: the number of the controller's output for each device.
//! Frame and unit: output numbers as the controller counts them.

/// Numbers of the controller's outputs for the devices of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Outputs {
    /// The line laser.
    pub line: u16,
    /// The laser pointer.
    pub pointer: u16,
    /// The room's lamp.
    pub room: u16,
    /// The gripper: on closes it.
    pub gripper: u16,
}

impl Default for Outputs {
    /// The first user outputs of an RC8.
    fn default() -> Outputs {
        Outputs { line: 24, pointer: 25, room: 26, gripper: 27 }
    }
}
