//! In: nothing. Out: the table of Modbus registers, said once for `robot serve` and `station serve`;
//! docs/connections.md shows it. Pure.
//! Frame and unit: addresses count from 0.

/// Number of the table; it changes with the meaning of a register.
pub const TABLE: u16 = 1;
/// Registers of a pose: six numbers of two words.
pub const POSE: usize = 12;
/// Units of a pose's registers in a mm and in a degree. 1/10,000 degree is 0.9 um at half a metre.
pub const PER_MM: f64 = 1000.0;
pub const PER_DEGREE: f64 = 10_000.0;
/// Units of a standard deviation's registers in a mm and in a degree: in 1/1000 mm 0.02 mm would have two digits.
pub const PER_SIGMA: f64 = 10_000.0;

/// Addresses that the PLC writes.
pub mod holding {
    pub const NUMBER: usize = 0;
    pub const WORD: usize = 1;
    pub const WHICH: usize = 2;
    /// Of a calibration.
    pub const TARGET: usize = 2;
    pub const OF: usize = 3;
    pub const POSE: usize = 4;
    /// The name of a recipe or recording.
    pub const NAME: usize = 16;
    pub const SWEEP: usize = 36;
    /// Without jobs the table ends before the sweep.
    pub const COUNT: usize = 36;
    pub const COUNT_WITH_JOBS: usize = 38;
}

/// Addresses that it reads.
pub mod input {
    pub const TABLE: usize = 0;
    pub const SECONDS: usize = 1;
    pub const BUSY: usize = 2;
    pub const ANSWERED: usize = 3;
    pub const ERROR: usize = 4;
    pub const STATE: usize = 5;
    pub const SHOTS: usize = 6;
    pub const SCORE: usize = 7;
    pub const POSE: usize = 8;
    /// Number of characters; the registers of the words follow it.
    pub const LENGTH: usize = 20;
    pub const COUNT: usize = 121;

    pub const ROBOT: usize = 121;
    pub const JOB_STATE: usize = 122;
    pub const STEP: usize = 123;
    pub const ASKS: usize = 124;
    pub const JOB: usize = 125;
    pub const PROCEDURE: usize = 127;
    pub const JOB_ERROR: usize = 128;
    pub const ENDED: usize = 129;
    pub const INSERTED: usize = 130;
    pub const FOUND: usize = 131;
    pub const GATES: usize = 132;
    pub const GATES_PASSED: usize = 134;
    pub const INSERTION: usize = 136;
    pub const SIGMA: usize = 148;
    pub const JOB_LENGTH: usize = 154;
    // Behind what the first programs of stations had: who reads only that reads the same as before.
    pub const TARGET: usize = 255;
    pub const VERDICT: usize = 256;
    pub const SCANNED: usize = 257;
    pub const POINTS: usize = 259;
    /// Number of characters; the registers of the recording's name follow it.
    pub const RECORDING_LENGTH: usize = 261;
    pub const COUNT_WITH_JOBS: usize = 362;
}

/// Registers of words: 200 characters.
pub const WORDS: usize = 100;

/// Numbers of the requests.
pub mod request {
    /// Begins a scan, or orders one of a recording.
    pub const SCAN: u16 = 1;
    /// Takes a picture.
    pub const POSE: u16 = 2;
    /// Finds a part.
    pub const FIND: u16 = 3;
    /// Gives a pose.
    pub const GIVE: u16 = 4;
    /// Orders an insertion.
    pub const INSERT: u16 = 5;
    /// Stops what the station does.
    pub const STOP: u16 = 6;
    /// Orders a calibration.
    pub const CALIBRATE: u16 = 7;
}

/// The gates of a found part by their bit.
pub const GATES: [&str; 21] = [
    "score",
    "margin",
    "coverage",
    "agreement",
    "edges seen",
    "edges crossed",
    "sigma_mm",
    "sigma_deg",
    "disagreement_mm",
    "points that tell the turn",
    "turn told",
    "sizes' ratio",
    "range's ratio",
    "number of looks",
    "looks' ratio",
    "looks' misfit",
    "looks' turn_deg",
    "looks' tilt_deg",
    "unseen in plane, mm",
    "unseen height, mm",
    "unseen turn, deg",
];
/// The bit of a gate that the table does not name.
pub const OTHER_GATE: u32 = 31;

/// Two registers of a number of 32 bits, high word first [modbus 4.2: big-endian].
pub fn two(number: u32) -> [u16; 2] {
    [(number >> 16) as u16, number as u16]
}
