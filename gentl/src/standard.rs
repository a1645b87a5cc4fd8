//! Numbers of GenTL 1.5, of its pixel formats (PFNC) and component identifiers (SFNC), by the names of the standards.
//! Frame and unit: none.

/// Result of every function of the interface.
pub mod error {
    pub const SUCCESS: i32 = 0;
    pub const ERROR: i32 = -1001;
    pub const NOT_INITIALIZED: i32 = -1002;
    pub const NOT_IMPLEMENTED: i32 = -1003;
    pub const RESOURCE_IN_USE: i32 = -1004;
    pub const ACCESS_DENIED: i32 = -1005;
    pub const INVALID_HANDLE: i32 = -1006;
    pub const INVALID_ID: i32 = -1007;
    pub const INVALID_PARAMETER: i32 = -1009;
    pub const TIMEOUT: i32 = -1011;
    pub const ABORT: i32 = -1012;
    pub const NOT_AVAILABLE: i32 = -1014;
    pub const INVALID_ADDRESS: i32 = -1015;
    pub const BUFFER_TOO_SMALL: i32 = -1016;
    pub const INVALID_INDEX: i32 = -1017;
    pub const INVALID_VALUE: i32 = -1019;
    pub const RESOURCE_EXHAUSTED: i32 = -1020;
    pub const OUT_OF_MEMORY: i32 = -1021;
    pub const BUSY: i32 = -1022;
}

/// Type of an information's value.
pub mod datatype {
    pub const STRING: i32 = 1;
    pub const INT32: i32 = 5;
    pub const UINT32: i32 = 6;
    pub const UINT64: i32 = 8;
    pub const PTR: i32 = 10;
    pub const BOOL8: i32 = 11;
    pub const SIZET: i32 = 12;
}

/// Kind of an event.
pub mod event {
    pub const ERROR: i32 = 0;
    pub const NEW_BUFFER: i32 = 1;
    /// The last kind of the standard.
    pub const MODULE: i32 = 5;
}

/// Who may use a device, as asked for and as reported.
pub mod access {
    pub const CONTROL: i32 = 3;
    pub const EXCLUSIVE: i32 = 4;
    pub const STATUS_READWRITE: i32 = 1;
    pub const STATUS_NOACCESS: i32 = 3;
    pub const STATUS_OPEN_READWRITE: i32 = 5;
}

/// Content of a buffer, and of its parts.
pub mod payload {
    pub const IMAGE: usize = 1;
    pub const MULTI_PART: usize = 10;
    pub const PART_2D_IMAGE: usize = 1;
    pub const PART_3D_IMAGE: usize = 5;
    pub const PART_CONFIDENCE_MAP: usize = 9;
    pub const PFNC_32BIT: u64 = 4;
    pub const LITTLE_ENDIAN: i32 = 1;
}

/// Pixel formats of PFNC.
pub mod pixel {
    pub const MONO8: i64 = 0x0108_0001;
    pub const MONO16: i64 = 0x0110_0007;
    pub const COORD3D_C16: i64 = 0x0110_00B8;
    pub const COORD3D_C32F: i64 = 0x0120_00BF;
    pub const COORD3D_ABC32F: i64 = 0x0260_00C0;
    pub const CONFIDENCE8: i64 = 0x0108_00C6;
    pub const CONFIDENCE16: i64 = 0x0110_00C7;

    /// Bytes of a pixel: the standard writes its bits in the third byte.
    pub fn bytes(format: i64) -> usize {
        (format >> 16 & 0xff) as usize / 8
    }
}

/// Components of SFNC.
pub mod component {
    pub const INTENSITY: i64 = 1;
    pub const RANGE: i64 = 4;
    pub const CONFIDENCE: i64 = 6;
}
