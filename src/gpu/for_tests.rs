//! How unit tests get an adapter: without one they are skipped with a message, or fail if a GPU is required.

use super::Device;
use crate::fault::{Fault, Result};

/// How unit tests get an adapter. Without one they are skipped with a message, and fail if SHEETLIGHT_REQUIRE_GPU is
/// set.
impl Device {
    /// Any adapter.
    pub(crate) fn for_tests() -> Option<Device> {
        found(Device::open(), required())
    }

    /// A software adapter whose buffers can be read as texels. Other adapters do not use texels.
    pub(crate) fn with_texels_for_tests() -> Option<Device> {
        let device = Device::for_tests()?;
        if device.has_own_processors() || !device.info.unified_memory {
            eprintln!("SKIPPED, {} reads buffers as what they are", device.info.name);
            return None;
        }
        let name = device.info.name.clone();
        let texels = device.reads_texels.then_some(device);
        found(texels.ok_or_else(|| refused(&name)), required())
    }
}

fn required() -> bool {
    std::env::var_os("SHEETLIGHT_REQUIRE_GPU").is_some()
}

fn found(device: Result<Device>, required: bool) -> Option<Device> {
    if let Err(fault) = &device {
        assert!(!required, "SHEETLIGHT_REQUIRE_GPU is set: {fault}");
        eprintln!("SKIPPED, no GPU adapter: {fault}");
    }
    device.ok()
}

fn refused(name: &str) -> Fault {
    Fault::refused(format!("{name} cannot read texels")).next("use a software adapter whose buffers can be read so")
}

mod tests {
    use super::*;

    #[test]
    fn a_test_without_an_adapter_is_skipped_only_where_none_is_required() {
        let none = || Err(Fault::refused("no adapter"));
        assert!(found(none(), false).is_none());
        assert!(std::panic::catch_unwind(|| found(none(), true)).is_err());
    }
}
