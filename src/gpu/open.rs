//! In: the adapters of this machine. Out: one of them opened, reading arrays in the way that is fastest there.
//! Frame and unit: none.

use super::device::Device;
use super::texels_trial::trial;
use crate::fault::Result;

impl Device {
    /// Opens the best adapter, or the one whose name holds the text of the environment variable
    /// SHEETLIGHT_ADAPTER (any case).
    pub fn open() -> Result<Device> {
        let wanted = std::env::var("SHEETLIGHT_ADAPTER").ok().filter(|s| !s.is_empty());
        Device::open_named(wanted.as_deref())
    }

    /// Opens the best adapter whose name holds `wanted`.
    pub fn open_named(wanted: Option<&str>) -> Result<Device> {
        let mut device = Device::opened(wanted)?;
        device.reads_texels = !device.has_own_processors() && device.info.unified_memory && trial(&device)?;
        Ok(device)
    }
}

/// How unit tests get an adapter. Without one they are skipped aloud, and fail if SHEETLIGHT_REQUIRE_GPU is set.
#[cfg(test)]
impl Device {
    /// Any adapter.
    pub(crate) fn for_tests() -> Option<Device> {
        found(Device::open(), required())
    }

    /// A software adapter whose buffers can be read as texels. Other adapters have no use for texels.
    pub(crate) fn with_texels_for_tests() -> Option<Device> {
        let device = Device::for_tests()?;
        if device.has_own_processors() || !device.info.unified_memory {
            eprintln!("SKIPPED, {} reads buffers as what they are", device.info.name);
            return None;
        }
        let name = device.info.name.clone();
        let texels = device.reads_texels.then_some(device);
        found(texels.ok_or_else(|| crate::fault::Fault::refused(format!("{name} cannot read texels"))), required())
    }
}

#[cfg(test)]
fn required() -> bool {
    std::env::var_os("SHEETLIGHT_REQUIRE_GPU").is_some()
}

#[cfg(test)]
fn found(device: Result<Device>, required: bool) -> Option<Device> {
    if let Err(fault) = &device {
        assert!(!required, "SHEETLIGHT_REQUIRE_GPU is set: {fault}");
        eprintln!("SKIPPED, no GPU adapter: {fault}");
    }
    device.ok()
}

#[cfg(test)]
mod tests {
    use super::found;
    use crate::fault::Fault;

    #[test]
    fn a_test_without_an_adapter_is_skipped_only_where_none_is_required() {
        let none = || Err(Fault::refused("no adapter"));
        assert!(found(none(), false).is_none());
        assert!(std::panic::catch_unwind(|| found(none(), true)).is_err());
    }
}
