//! In: the adapters of this machine. Out: the one that was asked for, or a refusal that names all of them.

use crate::error::{Error, Kind, Result};
use std::fmt;

/// What a report says of an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// As the driver gives it.
    pub name: String,
    /// discrete GPU, integrated GPU, virtual GPU, CPU or other.
    pub kind: &'static str,
    /// The interface it is reached by: vulkan, metal or dx12.
    pub backend: String,
    /// Name and version of the driver, if it gives them.
    pub driver: String,
}

impl fmt::Display for Adapter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {}, {})", self.name, self.kind, self.backend, self.driver)
    }
}

impl Adapter {
    pub(crate) fn of(info: &wgpu::AdapterInfo) -> Adapter {
        Adapter {
            name: info.name.clone(),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete GPU",
                wgpu::DeviceType::IntegratedGpu => "integrated GPU",
                wgpu::DeviceType::VirtualGpu => "virtual GPU",
                wgpu::DeviceType::Cpu => "CPU",
                wgpu::DeviceType::Other => "other",
            },
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().into(),
        }
    }

    /// Its shaders run on the processor, as those of Mesa's lavapipe and of SwiftShader do.
    pub fn is_software(&self) -> bool {
        self.kind == "CPU"
    }

    /// wgpu's backend for its own tests accepts everything and computes nothing.
    fn computes(&self) -> bool {
        self.backend != "noop"
    }

    #[cfg(test)]
    pub(crate) fn for_tests() -> Adapter {
        Adapter { name: "Some <GPU>".into(), kind: "CPU", backend: "vulkan".into(), driver: "driver 1.0".into() }
    }
}

/// Which adapter is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// The best one: discrete, integrated, virtual, other, software.
    Any,
    /// One whose shaders run on the processor.
    Software,
    /// One that is not software.
    Gpu,
    /// The best one whose name holds this text, in any case of letters.
    Named(String),
}

impl Wanted {
    /// The environment variable that [`Wanted::from_env`] reads.
    pub const VARIABLE: &str = "SHADER_TWIN_ADAPTER";

    /// What SHADER_TWIN_ADAPTER asks for: `software`, `gpu`, or a part of a name. Unset or empty: any adapter.
    ///
    /// # Errors
    ///
    /// [`Kind::Usage`] where the variable is not Unicode.
    pub fn from_env() -> Result<Wanted> {
        match std::env::var(Self::VARIABLE) {
            Ok(text) => Ok(Wanted::parse(&text)),
            Err(std::env::VarError::NotPresent) => Ok(Wanted::Any),
            Err(e) => Err(Error::new(Kind::Usage, format!("{}: {e}", Self::VARIABLE))
                .next("set it to software, gpu, or a part of the adapter's name")),
        }
    }

    /// The same from a text.
    pub fn parse(text: &str) -> Wanted {
        match text.trim().to_lowercase().as_str() {
            "" => Wanted::Any,
            "software" => Wanted::Software,
            "gpu" => Wanted::Gpu,
            _ => Wanted::Named(text.trim().into()),
        }
    }

    fn takes(&self, adapter: &Adapter) -> bool {
        match self {
            Wanted::Any => true,
            Wanted::Software => adapter.is_software(),
            Wanted::Gpu => !adapter.is_software(),
            Wanted::Named(part) => adapter.name.to_lowercase().contains(&part.to_lowercase()),
        }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Wanted::Any => f.write_str("any adapter"),
            Wanted::Software => f.write_str("a software adapter"),
            Wanted::Gpu => f.write_str("a GPU that is not software"),
            Wanted::Named(part) => write!(f, "an adapter whose name holds '{part}'"),
        }
    }
}

/// The position of the best adapter of a list that was asked for.
pub(crate) fn chosen(all: &[Adapter], wanted: &Wanted) -> Result<usize> {
    if all.is_empty() {
        return Err(Error::new(Kind::NoAdapter, "0 Vulkan, Metal or DX12 adapters found, 1 is needed")
            .cause("no GPU driver is installed")
            .next("install one; for software Vulkan on Debian and Ubuntu: apt-get install mesa-vulkan-drivers"));
    }
    // Before the order: a request is never answered with another adapter.
    let order = ["discrete GPU", "integrated GPU", "virtual GPU", "other", "CPU"];
    let found = all.iter().enumerate().filter(|(_, a)| wanted.takes(a) && a.computes());
    found.min_by_key(|(_, a)| order.iter().position(|k| *k == a.kind)).map(|(i, _)| i).ok_or_else(|| {
        let names: Vec<String> = all.iter().map(Adapter::to_string).collect();
        Error::new(Kind::WrongAdapter, format!("{wanted} was asked for; this machine has: {}", names.join(", ")))
            .cause("the driver of the wanted adapter is not installed, or the name is mistyped")
            .next(format!("correct the request (variable {}), or install the driver", Wanted::VARIABLE))
    })
}

pub(crate) fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // Vulkan, Metal, DX12: backends with full compute shaders.
    descriptor.backends = wgpu::Backends::PRIMARY;
    wgpu::Instance::new(descriptor)
}

/// All adapters of this machine.
pub fn adapters() -> Vec<Adapter> {
    let all = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    all.iter().map(|a| Adapter::of(&a.get_info())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(name: &str, kind: &'static str, backend: &str) -> Adapter {
        Adapter { name: name.into(), kind, backend: backend.into(), driver: "d".into() }
    }

    #[test]
    fn a_request_is_never_answered_with_another_adapter() {
        let all = [adapter("llvmpipe (LLVM 15)", "CPU", "vulkan"), adapter("Some GPU", "discrete GPU", "vulkan")];
        let at = |all: &[Adapter], wanted: &str| chosen(all, &Wanted::parse(wanted));
        assert_eq!(at(&all, ""), Ok(1));
        assert_eq!(at(&all, "software"), Ok(0));
        assert_eq!(at(&all, "GPU"), Ok(1));
        assert_eq!(at(&all, "LLVMpipe"), Ok(0));
        for (all, wanted) in [(&all[..1], "gpu"), (&all[1..], "software"), (&all[..], "other name")] {
            let refused = at(all, wanted).unwrap_err();
            assert_eq!(refused.kind(), Kind::WrongAdapter);
            assert!(refused.to_string().contains(&all[0].name), "{refused}");
        }
        assert_eq!(at(&[], "").unwrap_err().kind(), Kind::NoAdapter);
    }

    #[test]
    fn an_adapter_that_computes_nothing_is_refused() {
        let refused = chosen(&[adapter("noop wgpu backend", "other", "noop")], &Wanted::Any).unwrap_err();
        assert_eq!(refused.kind(), Kind::WrongAdapter);
    }
}
