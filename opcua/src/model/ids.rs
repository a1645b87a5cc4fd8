//! In: nothing. Out: numbers and names of the nodes of OPC 40100-1 that are served [opc-mv, OPC UA for Machine Vision
//! part 1, release 1.00, namespace http://opcfoundation.org/UA/MachineVision]. Pure.

/// The namespace of the specification, and ours.
pub const VISION: &str = "http://opcfoundation.org/UA/MachineVision";
pub const OWN: &str = "urn:sheetlight:vision";

/// Object types.
pub mod kind {
    pub const VISION_SYSTEM: u32 = 1003;
    pub const RECIPE_MANAGEMENT: u32 = 1004;
    pub const RESULT_MANAGEMENT: u32 = 1007;
    pub const VISION_STATE_MACHINE: u32 = 1017;
    pub const AUTOMATIC_STATE_MACHINE: u32 = 1021;
    pub const JOB_STARTED: u32 = 1013;
    pub const STATE_CHANGED: u32 = 1018;
    pub const RECIPE_PREPARED: u32 = 1022;
    pub const READY: u32 = 1023;
    pub const RESULT_READY: u32 = 1024;
}

/// Data types.
pub mod data {
    pub const RECIPE_ID_EXTERNAL: u32 = 3002;
    pub const PRODUCT_ID: u32 = 3003;
    pub const PART_ID: u32 = 3004;
    pub const PROCESSING_TIMES: u32 = 3005;
    pub const RESULT: u32 = 3006;
    pub const CONFIGURATION_ID: u32 = 3008;
    pub const RESULT_STATE: u32 = 3009;
    pub const RECIPE_ID_INTERNAL: u32 = 3013;
    pub const TRI_STATE: u32 = 3014;
    pub const MEAS_ID: u32 = 3015;
    pub const JOB_ID: u32 = 3016;
    pub const TRIMMED_STRING: u32 = 3017;
    pub const HANDLE: u32 = 3018;
    pub const BINARY_ID: u32 = 3019;
    pub const RESULT_ID: u32 = 3021;
}

/// States.
pub mod state {
    pub const PREOPERATIONAL: u32 = 5028;
    pub const HALTED: u32 = 5029;
    pub const ERROR: u32 = 5030;
    pub const OPERATIONAL: u32 = 5031;
    pub const INITIALIZED: u32 = 5056;
    pub const READY: u32 = 5057;
    pub const SINGLE_EXECUTION: u32 = 5058;
}

/// Transitions that are made.
pub mod transition {
    pub const PREOPERATIONAL_TO_HALTED: u32 = 5032;
    pub const PREOPERATIONAL_TO_ERROR_AUTO: u32 = 5034;
    pub const HALTED_TO_PREOPERATIONAL: u32 = 5037;
    pub const ERROR_TO_PREOPERATIONAL: u32 = 5039;
    pub const ERROR_TO_PREOPERATIONAL_AUTO: u32 = 5040;
    pub const ERROR_TO_HALTED: u32 = 5041;
    pub const OPERATIONAL_TO_PREOPERATIONAL: u32 = 5047;
    pub const OPERATIONAL_TO_HALTED: u32 = 5049;
    pub const OPERATIONAL_TO_ERROR_AUTO: u32 = 5051;
    pub const INITIALIZED_TO_READY_RECIPE: u32 = 5060;
    pub const READY_TO_INITIALIZED_RECIPE: u32 = 5062;
    pub const READY_TO_SINGLE_EXECUTION: u32 = 5064;
    pub const READY_TO_SINGLE_EXECUTION_AUTO: u32 = 5065;
    pub const SINGLE_EXECUTION_TO_READY_STOP: u32 = 5068;
    pub const SINGLE_EXECUTION_TO_READY_ABORT: u32 = 5069;
    pub const SINGLE_EXECUTION_TO_READY_AUTO: u32 = 5070;
    pub const PREOPERATIONAL_TO_OPERATIONAL: u32 = 5253;
}

/// A state of one of both machines.
pub struct State {
    pub id: u32,
    /// Of the outer machine.
    pub vision: bool,
    pub name: &'static str,
    pub number: u32,
    /// The property with its number.
    pub number_id: u32,
}

/// A transition.
pub struct Row {
    pub id: u32,
    pub vision: bool,
    pub name: &'static str,
    pub number: u32,
    pub number_id: u32,
    pub from: u32,
    pub to: u32,
    /// The method that causes it; 0: none.
    pub cause: u32,
}

/// Number and name, number of the transition with the number of its property, the states before and after, the cause.
const fn row(
    id: u32,
    vision: bool,
    name: &'static str,
    [number, number_id]: [u32; 2],
    [from, to]: [u32; 2],
    cause: u32,
) -> Row {
    Row { id, vision, name, number, number_id, from, to, cause }
}

/// The states [opc-mv, tables 82 and 97].
pub const STATES: [State; 8] = [
    State { id: 5028, vision: true, name: "Preoperational", number: 1, number_id: 6226 },
    State { id: 5029, vision: true, name: "Halted", number: 2, number_id: 6227 },
    State { id: 5030, vision: true, name: "Error", number: 3, number_id: 6228 },
    State { id: 5031, vision: true, name: "Operational", number: 4, number_id: 6229 },
    State { id: 5056, vision: false, name: "Initialized", number: 5, number_id: 6259 },
    State { id: 5057, vision: false, name: "Ready", number: 6, number_id: 6260 },
    State { id: 5058, vision: false, name: "SingleExecution", number: 7, number_id: 6261 },
    State { id: 5059, vision: false, name: "ContinuousExecution", number: 8, number_id: 6262 },
];

/// The transitions [opc-mv, tables 84 and 99].
pub const TRANSITIONS: [Row; 35] = [
    row(5033, true, "PreoperationalToHaltedAuto", [120, 6231], [5028, 5029], 0),
    row(5032, true, "PreoperationalToHalted", [121, 6230], [5028, 5029], 7094),
    row(5034, true, "PreoperationalToErrorAuto", [130, 6232], [5028, 5030], 0),
    row(5254, true, "PreoperationalToOperationalAuto", [140, 6221], [5028, 5031], 0),
    row(5253, true, "PreoperationalToOperational", [141, 6171], [5028, 5031], 7095),
    row(5036, true, "PreoperationalToInitializedAuto", [150, 6234], [5028, 5056], 0),
    row(5035, true, "PreoperationalToInitialized", [151, 6233], [5028, 5056], 7095),
    row(5038, true, "HaltedToPreoperationalAuto", [210, 6236], [5029, 5028], 0),
    row(5037, true, "HaltedToPreoperational", [211, 6235], [5029, 5028], 7093),
    row(5040, true, "ErrorToPreoperationalAuto", [310, 6238], [5030, 5028], 0),
    row(5039, true, "ErrorToPreoperational", [311, 6237], [5030, 5028], 7093),
    row(5042, true, "ErrorToHaltedAuto", [320, 6240], [5030, 5029], 0),
    row(5041, true, "ErrorToHalted", [321, 6239], [5030, 5029], 7094),
    row(5255, true, "ErrorToOperationalAuto", [340, 6341], [5030, 5031], 0),
    row(5048, true, "OperationalToPreoperationalAuto", [410, 6246], [5031, 5028], 0),
    row(5047, true, "OperationalToPreoperational", [411, 6245], [5031, 5028], 7093),
    row(5050, true, "OperationalToHaltedAuto", [420, 6248], [5031, 5029], 0),
    row(5049, true, "OperationalToHalted", [421, 6247], [5031, 5029], 7094),
    row(5051, true, "OperationalToErrorAuto", [430, 6249], [5031, 5030], 0),
    row(5061, false, "InitializedToReadyAuto", [560, 6264], [5056, 5057], 0),
    row(5060, false, "InitializedToReadyRecipe", [561, 6263], [5056, 5057], 7015),
    row(5045, false, "InitializedToReadyProduct", [562, 6084], [5056, 5057], 7060),
    row(5063, false, "ReadyToInitializedAuto", [650, 6266], [5057, 5056], 0),
    row(5062, false, "ReadyToInitializedRecipe", [651, 6265], [5057, 5056], 7055),
    row(5044, false, "ReadyToInitializedProduct", [652, 6243], [5057, 5056], 7059),
    row(5065, false, "ReadyToSingleExecutionAuto", [670, 6268], [5057, 5058], 0),
    row(5064, false, "ReadyToSingleExecution", [671, 6267], [5057, 5058], 7098),
    row(5067, false, "ReadyToContinuousExecutionAuto", [680, 6270], [5057, 5059], 0),
    row(5066, false, "ReadyToContinuousExecution", [681, 6269], [5057, 5059], 7009),
    row(5070, false, "SingleExecutionToReadyAuto", [760, 6273], [5058, 5057], 0),
    row(5068, false, "SingleExecutionToReadyStop", [761, 6271], [5058, 5057], 7096),
    row(5069, false, "SingleExecutionToReadyAbort", [762, 6272], [5058, 5057], 7097),
    row(5073, false, "ContinuousExecutionToReadyAuto", [860, 6276], [5059, 5057], 0),
    row(5071, false, "ContinuousExecutionToReadyStop", [861, 6274], [5059, 5057], 7096),
    row(5072, false, "ContinuousExecutionToReadyAbort", [862, 6275], [5059, 5057], 7097),
];

/// The type of an argument.
#[derive(Clone, Copy)]
pub enum Of {
    /// Of the core namespace.
    Core(u32),
    /// Of the specification.
    Vision(u32),
}

/// Name, type and whether it is an array.
pub type Argument = (&'static str, Of, bool);

/// A method as its type has it.
pub struct Method {
    /// The type that has it.
    pub owner: u32,
    pub id: u32,
    pub name: &'static str,
    /// Numbers of its arguments' properties; 0: it has none.
    pub inputs_id: u32,
    pub outputs_id: u32,
    pub mandatory: bool,
    pub takes: &'static [Argument],
    pub gives: &'static [Argument],
}

const BOOLEAN: Of = Of::Core(1);
const INT32: Of = Of::Core(6);
const UINT32: Of = Of::Core(7);
const STRING: Of = Of::Core(12);
const BASE: Of = Of::Core(24);
const UTC_TIME: Of = Of::Core(294);
const EXTERNAL: Of = Of::Vision(data::RECIPE_ID_EXTERNAL);
const INTERNAL: Of = Of::Vision(data::RECIPE_ID_INTERNAL);
const PRODUCT: Of = Of::Vision(data::PRODUCT_ID);
const CONFIGURATION: Of = Of::Vision(data::CONFIGURATION_ID);
const MEAS: Of = Of::Vision(data::MEAS_ID);
const PART: Of = Of::Vision(data::PART_ID);
const JOB: Of = Of::Vision(data::JOB_ID);
const RESULT_ID: Of = Of::Vision(data::RESULT_ID);
const RESULT_STATE: Of = Of::Vision(data::RESULT_STATE);
const HANDLE: Of = Of::Vision(data::HANDLE);

const CAUSE: &[Argument] = &[("Cause", INT32, false), ("CauseDescription", STRING, false)];
const ERROR: &[Argument] = &[("Error", INT32, false)];
const START: &[Argument] = &[
    ("MeasId", MEAS, false),
    ("PartId", PART, false),
    ("RecipeId", EXTERNAL, false),
    ("ProductId", PRODUCT, false),
    ("Parameters", BASE, true),
];
const STARTED: &[Argument] = &[("JobId", JOB, false), ("Error", INT32, false)];

const fn method(
    owner: u32,
    id: u32,
    name: &'static str,
    [inputs_id, outputs_id]: [u32; 2],
    mandatory: bool,
    takes: &'static [Argument],
    gives: &'static [Argument],
) -> Method {
    Method { owner, id, name, inputs_id, outputs_id, mandatory, takes, gives }
}

/// The methods that are served. Optional ones of the specification are not here.
pub const METHODS: [Method; 13] = [
    method(kind::VISION_STATE_MACHINE, 7094, "Halt", [6254, 6255], true, CAUSE, ERROR),
    method(kind::VISION_STATE_MACHINE, 7093, "Reset", [6256, 6257], true, CAUSE, ERROR),
    method(kind::VISION_STATE_MACHINE, 7095, "SelectModeAutomatic", [0, 6258], false, &[], ERROR),
    method(kind::AUTOMATIC_STATE_MACHINE, 7098, "StartSingleJob", [6281, 6282], true, START, STARTED),
    method(kind::AUTOMATIC_STATE_MACHINE, 7009, "StartContinuous", [6086, 6087], true, START, STARTED),
    method(kind::AUTOMATIC_STATE_MACHINE, 7096, "Stop", [6287, 6288], true, CAUSE, ERROR),
    method(kind::AUTOMATIC_STATE_MACHINE, 7097, "Abort", [6285, 6286], true, CAUSE, ERROR),
    method(
        kind::RECIPE_MANAGEMENT,
        7014,
        "GetRecipeListFiltered",
        [6156, 6157],
        true,
        &[
            ("ExternalId", EXTERNAL, false),
            ("ProductId", PRODUCT, false),
            ("IsPrepared", Of::Vision(data::TRI_STATE), false),
            ("MaxResults", UINT32, false),
            ("StartIndex", UINT32, false),
            ("Timeout", INT32, false),
        ],
        &[
            ("IsComplete", BOOLEAN, false),
            ("ResultCount", UINT32, false),
            ("RecipeHandle", HANDLE, false),
            ("RecipeList", INTERNAL, true),
            ("Error", INT32, false),
        ],
    ),
    method(
        kind::RECIPE_MANAGEMENT,
        7015,
        "PrepareRecipe",
        [6148, 6149],
        true,
        &[("ExternalId", EXTERNAL, false), ("InternalIdIn", INTERNAL, false)],
        &[("InternalIdOut", INTERNAL, false), ("IsCompleted", BOOLEAN, false), ("Error", INT32, false)],
    ),
    method(
        kind::RECIPE_MANAGEMENT,
        7055,
        "UnprepareRecipe",
        [6152, 6153],
        true,
        &[("ExternalId", EXTERNAL, false), ("InternalIdIn", INTERNAL, false)],
        &[("InternalIdOut", INTERNAL, false), ("Error", INT32, false)],
    ),
    method(
        kind::RESULT_MANAGEMENT,
        7026,
        "GetResultById",
        [6209, 6210],
        true,
        &[("ResultId", RESULT_ID, false), ("Timeout", INT32, false)],
        &[("ResultHandle", HANDLE, false), ("Result", Of::Vision(data::RESULT), false), ("Error", INT32, false)],
    ),
    method(
        kind::RESULT_MANAGEMENT,
        7007,
        "GetResultComponentsById",
        [6024, 6025],
        true,
        &[("ResultId", RESULT_ID, false), ("Timeout", INT32, false)],
        &[
            ("HasTransferableDataOnFile", BOOLEAN, false),
            ("ResultHandle", HANDLE, false),
            ("IsPartial", BOOLEAN, false),
            ("IsSimulated", BOOLEAN, false),
            ("ResultState", RESULT_STATE, false),
            ("MeasId", MEAS, false),
            ("PartId", PART, false),
            ("ExternalRecipeId", EXTERNAL, false),
            ("InternalRecipeId", INTERNAL, false),
            ("ProductId", PRODUCT, false),
            ("ExternalConfigurationId", CONFIGURATION, false),
            ("InternalConfigurationId", CONFIGURATION, false),
            ("JobId", JOB, false),
            ("CreationTime", UTC_TIME, false),
            ("ProcessingTimes", Of::Vision(data::PROCESSING_TIMES), false),
            ("ResultContent", BASE, true),
            ("Error", INT32, false),
        ],
    ),
    method(
        kind::RESULT_MANAGEMENT,
        7089,
        "GetResultListFiltered",
        [6213, 6214],
        true,
        &[
            ("ResultState", RESULT_STATE, false),
            ("MeasId", MEAS, false),
            ("PartId", PART, false),
            ("ExternalRecipeId", EXTERNAL, false),
            ("InternalRecipeId", INTERNAL, false),
            ("ExternalConfigurationId", CONFIGURATION, false),
            ("InternalConfigurationId", CONFIGURATION, false),
            ("ProductId", PRODUCT, false),
            ("JobId", JOB, false),
            ("MaxResults", UINT32, false),
            ("StartIndex", UINT32, false),
            ("Timeout", INT32, false),
        ],
        &[
            ("IsComplete", BOOLEAN, false),
            ("ResultCount", UINT32, false),
            ("ResultHandle", HANDLE, false),
            ("ResultList", Of::Vision(data::RESULT), true),
            ("Error", INT32, false),
        ],
    ),
];

/// A transition by its number.
pub fn transition_of(id: u32) -> &'static Row {
    TRANSITIONS.iter().find(|row| row.id == id).expect("the numbers of this table")
}
