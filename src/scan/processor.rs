//! In: where the stages shall run. Out: the GPU, opened, or the CPU twins.
//! Frame and unit: none.

use crate::fault::Result;
use crate::gpu::Device;

/// Where the stages run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Where {
    /// On the GPU where there is one, else on the CPU twins, which give the same results.
    #[default]
    Auto,
    Gpu,
    Cpu,
}

impl std::str::FromStr for Where {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Where, String> {
        match s {
            "auto" => Ok(Where::Auto),
            "gpu" => Ok(Where::Gpu),
            "cpu" => Ok(Where::Cpu),
            _ => Err(format!("unknown place '{s}': auto, gpu or cpu")),
        }
    }
}

/// What the stages run on.
#[derive(Clone)]
pub enum Processor {
    Twins,
    Gpu(Device),
}

impl Where {
    /// Refused: `Where::Gpu` on a machine without one.
    pub fn open(self) -> Result<Processor> {
        Ok(match self {
            Where::Cpu => Processor::Twins,
            Where::Gpu => Processor::Gpu(Device::open()?),
            // The twins give the same results, so a machine without a GPU is no error.
            Where::Auto => Device::open().map_or(Processor::Twins, Processor::Gpu),
        })
    }
}
