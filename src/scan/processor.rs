//! In: the place where the stages are to run, and this machine's adapters. Out: an opened GPU, or this machine's own
//! processor with the reason for it.
//! Frame and unit: none.

use crate::fault::Result;
use crate::gpu::{AdapterInfo, Device, adapters};

/// Where the stages run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Where {
    /// On a GPU with dedicated processors if there is one, else on this machine's processor, which gives the same
    /// results.
    #[default]
    Auto,
    /// On the best GPU adapter, which may be a software one; a machine without any adapter is refused.
    Gpu,
    /// On this machine's own processor.
    Cpu,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Where>("place", word)
}

/// Why the stages run without a GPU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Why {
    /// The user chose the processor.
    Asked,
    /// This machine has no GPU adapter.
    NoAdapter,
    /// The best adapter is software of this name: it uses the same cores, with more overhead.
    Software(String),
    /// The adapter did not open.
    Failed(String),
}

impl std::fmt::Display for Why {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Why::Asked => write!(f, "as asked"),
            Why::NoAdapter => write!(f, "no GPU adapter found"),
            Why::Software(name) => write!(f, "{name} is software on the same cores, which is slower"),
            Why::Failed(what) => write!(f, "the GPU did not open: {what}"),
        }
    }
}

/// What the stages run on.
#[derive(Clone)]
pub enum Processor {
    /// This machine's own processor.
    Host(Why),
    /// A GPU, opened.
    Gpu(Device),
}

impl Processor {
    /// This machine's own processor, by request.
    pub fn host() -> Processor {
        Processor::Host(Why::Asked)
    }
}

impl Where {
    /// Refuses `Where::Gpu` on a machine without an adapter.
    pub fn open(self) -> Result<Processor> {
        // Whoever names an adapter wants it to be used.
        let named = std::env::var_os("SHEETLIGHT_ADAPTER").is_some_and(|name| !name.is_empty());
        Ok(match self {
            Where::Cpu => Processor::host(),
            Where::Gpu => Processor::Gpu(Device::open()?),
            Where::Auto => match without_gpu(&adapters(), named) {
                Some(why) => Processor::Host(why),
                // The results are the same, so a GPU that cannot be opened is no error.
                None => Device::open().map_or_else(|fault| Processor::Host(Why::Failed(fault.what)), Processor::Gpu),
            },
        })
    }
}

/// The reason why the best of these adapters is not used, if there is one. A software adapter was slower at every
/// size (`sheetlight doctor` times both).
fn without_gpu(adapters: &[AdapterInfo], named: bool) -> Option<Why> {
    match adapters.first() {
        _ if named => None,
        None => Some(Why::NoAdapter),
        Some(best) => (best.kind == "CPU").then(|| Why::Software(best.name.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(kind: &str) -> AdapterInfo {
        AdapterInfo {
            name: format!("a {kind}"),
            kind: kind.into(),
            backend: String::new(),
            driver: String::new(),
            max_binding_bytes: 0,
            max_workgroup: 0,
            storage_buffers_per_stage: 0,
            timestamps: false,
            unified_memory: false,
        }
    }

    #[test]
    fn a_software_adapter_is_taken_only_by_name() {
        let (gpu, software) = (adapter("discrete GPU"), adapter("CPU"));
        assert_eq!(without_gpu(&[], false), Some(Why::NoAdapter));
        assert_eq!(without_gpu(std::slice::from_ref(&software), false), Some(Why::Software("a CPU".into())));
        assert_eq!(without_gpu(std::slice::from_ref(&software), true), None);
        assert_eq!(without_gpu(&[gpu, software], false), None);
        assert_eq!(without_gpu(&[adapter("integrated GPU")], false), None);
    }
}
