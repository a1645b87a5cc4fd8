//! In: nothing. Out: the state of the controller's panel: mode, motor, errors, speeds, variables, which connection
//! has the arm.
//! Frame and unit: speeds in per cent.

use sheetlight::bcap::{Outcome, Variant};
use sheetlight::geometry::Vec3;
use std::collections::BTreeMap;

/// Value of @MODE when programs may move the arm.
pub const AUTOMATIC: i32 = 3;

/// The object behind a handle.
#[derive(Clone, Debug)]
pub enum Object {
    Controller,
    Robot,
    /// The variable's name.
    Variable(String),
}

/// The whole state of the panel.
pub struct Panel {
    pub mode: i32,
    pub motor: bool,
    pub emergency: bool,
    /// Code and text, newest first.
    pub errors: Vec<(u32, String)>,
    /// The connection that has the arm.
    pub taken: Option<u64>,
    pub tool: i32,
    pub work: i32,
    /// External speed, acceleration, deceleration.
    pub external: [f64; 3],
    /// Internal speed.
    pub internal: f64,
    /// `figure`: the reported figure, if it differs from that of the joints. `next_figure`: the figure that the
    /// next motion sets.
    pub figure: Option<i32>,
    pub next_figure: Option<i32>,
    pub variables: BTreeMap<String, Variant>,
    /// Corners of a box that the flange may not enter, mm.
    pub fence: Option<[Vec3; 2]>,
    /// The motion under way, and the outcome with which it was stopped, if it was.
    pub motion: Option<(u64, Option<Outcome>)>,
    pub motions: u64,
    /// Outcomes of ended motions, until they are queried.
    pub ended: BTreeMap<u64, Outcome>,
    pub objects: BTreeMap<i32, (u64, Object)>,
    /// Error texts in Japanese.
    pub japanese: bool,
    /// Does not report that it is simulated.
    pub as_real: bool,
    /// Makes the time stamp of a pose, ms, from the cell's time.
    pub stamp: fn(f64) -> f64,
    /// The reported poses stay as they were at this time, s.
    pub frozen: Option<f64>,
}

impl Default for Panel {
    fn default() -> Panel {
        Panel {
            mode: AUTOMATIC,
            motor: false,
            emergency: false,
            errors: Vec::new(),
            taken: None,
            tool: 0,
            work: 0,
            external: [100.0; 3],
            internal: 100.0,
            figure: None,
            next_figure: None,
            variables: BTreeMap::new(),
            fence: None,
            motion: None,
            motions: 0,
            ended: BTreeMap::new(),
            objects: BTreeMap::new(),
            japanese: false,
            as_real: false,
            stamp: |ms| ms,
            frozen: None,
        }
    }
}

/// The controller's text for a code.
pub fn text(code: u32, japanese: bool) -> String {
    if japanese {
        return "未定義エラーです。".into();
    }
    match code {
        0x8007_0057 => "Invalid argument.".into(),
        0x8150_1003 => "Motor power is off.".into(),
        0x8150_1025 => "An error is pending.".into(),
        0x8320_F001 => "The arm is taken by another client.".into(),
        0x8320_F002 => "The arm is not taken.".into(),
        0x8320_F003 => "Out of motion space.".into(),
        0x8320_F005 => "Emergency stop.".into(),
        0x8320_F006 => "Not in automatic mode.".into(),
        0x8320_F007 => "Virtual fence.".into(),
        0x8320_4071..=0x8320_4078 => format!("J{} is out of its range.", code & 0xf),
        _ => "Undefined error.".into(),
    }
}
