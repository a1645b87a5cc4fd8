//! The adapter of these tests: SHADER_TWIN_ADAPTER, or any. A machine without one fails, unless
//! SHADER_TWIN_ALLOW_SKIP is set.

use shader_twin::{Device, Wanted};

pub fn device() -> Option<Device> {
    let wanted = Wanted::from_env().unwrap_or_else(|e| panic!("{e}"));
    let opened = match std::env::var_os("SHADER_TWIN_ALLOW_SKIP") {
        Some(_) => Device::open_or_skip(&wanted),
        None => Device::open(&wanted).map(Some),
    };
    opened.unwrap_or_else(|e| panic!("{e}"))
}
