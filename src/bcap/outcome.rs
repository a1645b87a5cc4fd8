//! In: the HRESULT of a reply. Out: whether the call succeeded, and the meaning in words.
//! Frame and unit: none. Codes: Denso's client code, and the public part of the controller's error tables.

use std::fmt;

/// The HRESULT of a reply.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Outcome(pub u32);

impl Outcome {
    /// The call succeeded.
    pub const OK: Outcome = Outcome(0);
    /// No answer yet: the call is under way. Sent every `WDT` milliseconds.
    pub const INTERIM: Outcome = Outcome(0x0000_0900);
    /// The controller does not have this call.
    pub const NOT_IMPLEMENTED: Outcome = Outcome(0x8000_4001);
    /// The motion was halted.
    pub const ABORTED: Outcome = Outcome(0x8000_4004);
    /// There is no such robot, provider or variable.
    pub const NO_SUCH_OBJECT: Outcome = Outcome(0x8000_0204);
    /// The variable can only be read.
    pub const NOT_WRITABLE: Outcome = Outcome(0x8000_020A);
    /// The service was not started on this connection.
    pub const NOT_STARTED: Outcome = Outcome(0x8000_0902);
    /// The controller does not know this command.
    pub const UNKNOWN_COMMAND: Outcome = Outcome(0x8000_0904);
    /// The controller expects a value of another type.
    pub const BAD_TYPE: Outcome = Outcome(0x8002_0005);
    /// The controller does not know this object any more.
    pub const BAD_HANDLE: Outcome = Outcome(0x8007_0006);
    /// The controller refuses a value.
    pub const BAD_ARGUMENT: Outcome = Outcome(0x8007_0057);
    /// The controller is busy with a call of this connection.
    pub const BUSY: Outcome = Outcome(0x8091_00AA);
    /// The motor is off.
    pub const MOTOR_OFF: Outcome = Outcome(0x8150_1003);
    /// An error is pending on the controller.
    pub const ERROR_PENDING: Outcome = Outcome(0x8150_1025);
    /// The executable token is not set to Ethernet.
    pub const NO_TOKEN: Outcome = Outcome(0x8350_1028);

    /// True for an error: the highest bit is set.
    pub fn failed(self) -> bool {
        self.0 >= 0x8000_0000
    }
    /// From the I4 in which controllers send it.
    pub fn from_i32(code: i32) -> Outcome {
        Outcome(code as u32)
    }
    /// The meaning and what to do, if known.
    pub fn words(self) -> Option<(&'static str, &'static str)> {
        Some(match self {
            Outcome::NOT_IMPLEMENTED => ("the controller does not have this call", "use another controller version"),
            Outcome::ABORTED => ("the motion was halted", "look at the robot, then read its pose again"),
            Outcome::NO_SUCH_OBJECT => {
                ("there is no such robot, provider or variable", "check its name on the pendant")
            }
            Outcome::NOT_WRITABLE => ("this variable can only be read", "write another one"),
            Outcome::NOT_STARTED => ("the service was not started", "connect again"),
            Outcome::UNKNOWN_COMMAND => ("the controller does not know this command", "use another controller version"),
            Outcome::BAD_TYPE => ("the controller wants another type of value", "check the variable's type"),
            Outcome::BAD_HANDLE => ("the controller does not know this object any more", "connect again"),
            Outcome::BAD_ARGUMENT => ("the controller refuses a value", "check the numbers against its limits"),
            Outcome::BUSY => ("the controller is busy with a call of this connection", "wait for it, or connect again"),
            Outcome::MOTOR_OFF => ("the motor is off", "switch the motor on"),
            Outcome::ERROR_PENDING => {
                ("an error is pending on the controller", "clear it on the pendant or with ClearError")
            }
            Outcome::NO_TOKEN => (
                "the executable token is not set to Ethernet",
                "set it on the pendant: Settings, Communication, Executable token",
            ),
            Outcome(code @ 0x8320_4071..=0x8320_4078) => (
                match code & 0xf {
                    1 => "joint 1 would leave its range",
                    2 => "joint 2 would leave its range",
                    3 => "joint 3 would leave its range",
                    4 => "joint 4 would leave its range",
                    5 => "joint 5 would leave its range",
                    6 => "joint 6 would leave its range",
                    7 => "joint 7 would leave its range",
                    _ => "joint 8 would leave its range",
                },
                "approach from another side, or with another figure",
            ),
            _ => return None,
        })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:08X}", self.0)?;
        match self.words() {
            Some((what, _)) => write!(f, " ({what})"),
            None => Ok(()),
        }
    }
}

impl fmt::Debug for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}
