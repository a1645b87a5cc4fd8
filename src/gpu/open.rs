//! In: the adapters of this machine. Out: one of them opened, with the fastest way of reading arrays on it. Frame and
//! unit: none.

use super::device::Device;
use super::texels_trial::trial;
use crate::fault::Result;

impl Device {
    /// Opens the best adapter, or the best one whose name contains the text of the environment variable
    /// SHEETLIGHT_ADAPTER (any case).
    pub fn open() -> Result<Device> {
        let wanted = std::env::var("SHEETLIGHT_ADAPTER").ok().filter(|s| !s.is_empty());
        Device::open_named(wanted.as_deref())
    }

    /// Opens the best adapter whose name contains `wanted`.
    pub fn open_named(wanted: Option<&str>) -> Result<Device> {
        let mut device = Device::opened(wanted)?;
        device.reads_texels = !device.has_own_processors() && device.info.unified_memory && trial(&device)?;
        Ok(device)
    }
}
