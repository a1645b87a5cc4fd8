//! In: a call to make to a controller. Out: the number of the call on the wire, and its name.
//! Frame and unit: none. Numbers: Denso's b-CAP function ids, as its client library sends them.

/// Defines the enum, its numbers and its names in one place.
macro_rules! calls {
    ($($name:ident = $id:literal $words:literal,)*) => {
        /// The calls that a controller answers.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u32)]
        pub enum Call {
            $(#[doc = concat!("Denso's `", $words, "`.")] $name = $id,)*
        }
        impl Call {
            /// All calls, ascending by number.
            pub const ALL: &[Call] = &[$(Call::$name,)*];
            /// The name in Denso's documents.
            pub fn name(self) -> &'static str {
                match self {
                    $(Call::$name => $words,)*
                }
            }
        }
    };
}

calls! {
    ServiceStart = 1 "Service_Start",
    ServiceStop = 2 "Service_Stop",
    ControllerConnect = 3 "Controller_Connect",
    ControllerDisconnect = 4 "Controller_Disconnect",
    ControllerGetRobot = 7 "Controller_GetRobot",
    ControllerGetVariable = 9 "Controller_GetVariable",
    ControllerGetRobotNames = 13 "Controller_GetRobotNames",
    ControllerGetTaskNames = 14 "Controller_GetTaskNames",
    ControllerExecute = 17 "Controller_Execute",
    RobotGetVariable = 62 "Robot_GetVariable",
    RobotExecute = 64 "Robot_Execute",
    RobotChange = 66 "Robot_Change",
    RobotGoHome = 69 "Robot_GoHome",
    RobotHalt = 70 "Robot_Halt",
    RobotMove = 72 "Robot_Move",
    RobotSpeed = 74 "Robot_Speed",
    RobotRelease = 84 "Robot_Release",
    VariableGetValue = 101 "Variable_GetValue",
    VariablePutValue = 102 "Variable_PutValue",
    VariableRelease = 111 "Variable_Release",
}

impl Call {
    /// The number that a request carries.
    pub fn number(self) -> u32 {
        self as u32
    }
    /// The call with this number; `None` for calls that Sheetlight neither makes nor answers.
    pub fn of(number: u32) -> Option<Call> {
        Call::ALL.iter().copied().find(|c| c.number() == number)
    }
}
