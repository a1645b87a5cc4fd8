//! In: an adapter. Out: a device on it that has computed known numbers. Every use of a device asks whether it was
//! lost.

use super::adapter::{Adapter, Wanted, chosen, instance};
use crate::case::Case;
use crate::error::{Error, Kind, Result};
use crate::stage::{Binding, Stage};
use crate::{Shape, Tolerance};
use std::cell::RefCell;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// An opened adapter of this machine. One thread at a time uses it: a run that does not end would otherwise take the
/// device from the runs of other threads.
pub struct Device {
    adapter: Adapter,
    wanted: Wanted,
    open: RefCell<Arc<Open>>,
}

/// What is replaced when a device is opened anew.
pub(super) struct Open {
    pub(super) raw: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    lost: Arc<Mutex<Option<String>>>,
}

/// Invocations of the first run.
const FIRST_RUN: u32 = 64;
/// Time for the first run: a driver compiles its first shader in it.
const FIRST_TIME: Duration = Duration::from_secs(60);

impl Device {
    /// Opens the best adapter that was asked for, never another one. It must compute known numbers in a first run.
    ///
    /// # Errors
    ///
    /// [`Kind::NoAdapter`] where the machine has no adapter, [`Kind::WrongAdapter`] where it lacks the wanted one or
    /// the adapter computes wrong numbers, [`Kind::Refused`] where the device cannot be opened.
    pub fn open(wanted: &Wanted) -> Result<Device> {
        let (adapter, open) = opened(wanted)?;
        let device = Device { adapter, wanted: wanted.clone(), open: RefCell::new(Arc::new(open)) };
        device.first_run()?;
        Ok(device)
    }

    /// As [`Device::open`]; a machine without any adapter gives `None` and a message on standard error. For callers
    /// that have decided that skipping is allowed. A wrong adapter is an error here as well.
    pub fn open_or_skip(wanted: &Wanted) -> Result<Option<Device>> {
        skipped(Device::open(wanted))
    }

    /// Opens the same adapter anew where an earlier run did not end in time or lost the device.
    pub(crate) fn revive(&self) -> Result<()> {
        if self.current().alive(&self.adapter).is_ok() {
            return Ok(());
        }
        let (adapter, open) = opened(&self.wanted)?;
        if adapter != self.adapter {
            let what = format!("{adapter} was opened in place of {}", self.adapter);
            return Err(Error::new(Kind::WrongAdapter, what).cause("the adapter was unplugged or its driver crashed"));
        }
        self.open.replace(Arc::new(open));
        self.first_run()
    }

    pub(super) fn current(&self) -> Arc<Open> {
        self.open.borrow().clone()
    }

    /// The adapter, for reports.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Proves that dispatches run: wrong numbers here would make every later comparison worthless.
    fn first_run(&self) -> Result<()> {
        let words = Binding::read_write("words", Shape::array::<u32>(), Tolerance::exact("whole numbers"));
        let stage = Stage::new("first run", include_str!("first_run.wgsl"), "main", [FIRST_RUN, 1, 1], vec![words]);
        let case = Case::new("first run", [1, 1, 1]).zeros(FIRST_RUN as usize);
        let compiled = self.compile(&stage, &stage.wgsl, &case.overrides)?;
        let out = self.run(&compiled, &stage, &case, FIRST_TIME)?;
        let wrong = (0..FIRST_RUN).zip(out[0].get::<u32>()).find(|(i, word)| **word != mixed(*i));
        wrong.map_or(Ok(()), |(i, word)| {
            let what = format!("{}: word {i} of the first run is {word:#x}, not {:#x}", self.adapter, mixed(i));
            Err(Error::new(Kind::WrongAdapter, what)
                .cause("the driver is broken, or it computes nothing")
                .next("ask for another adapter"))
        })
    }
}

/// Opens the best adapter that was asked for.
fn opened(wanted: &Wanted) -> Result<(Adapter, Open)> {
    let mut raw = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    let all: Vec<Adapter> = raw.iter().map(|a| Adapter::of(&a.get_info())).collect();
    let at = chosen(&all, wanted)?;
    let (chosen, adapter) = (raw.swap_remove(at), all[at].clone());
    // What shaders can ask for by themselves; the rest of the features does not concern compute shaders.
    let known = wgpu::Features::SHADER_F16
        | wgpu::Features::SUBGROUP
        | wgpu::Features::SHADER_INT64
        | wgpu::Features::SHADER_F64;
    let (raw, queue) = pollster::block_on(chosen.request_device(&wgpu::DeviceDescriptor {
        label: Some("shader-twin"),
        required_features: chosen.features() & known,
        // All that the adapter has: a stage is refused by its own adapter's limits only.
        required_limits: chosen.limits(),
        ..Default::default()
    }))
    .map_err(|e| {
        Error::new(Kind::Refused, format!("{adapter}: the device cannot be opened: {e}"))
            .cause("the driver is broken or its memory is used up")
            .next("close other programs, or ask for another adapter")
    })?;
    let lost = Arc::new(Mutex::new(None::<String>));
    let note = lost.clone();
    raw.set_device_lost_callback(move |reason, message| {
        note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(format!("{reason:?}: {message}"));
    });
    // Errors of our own calls are caught where they are made; what arrives later is the device's.
    let note = lost.clone();
    raw.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
        note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e.to_string());
    }));
    Ok((adapter, Open { raw, queue, lost }))
}

impl Open {
    pub(super) fn alive(&self, adapter: &Adapter) -> Result<()> {
        match &*self.lost.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(why) => Err(Error::new(Kind::Lost, format!("{adapter}: the device was lost: {}", why.trim()))
                .cause("the shader ran too long for the driver, the driver crashed, or its memory ran out")
                .next("run it again: the device is opened anew")),
        }
    }

    /// A device that does not answer is never used again. It is not closed either: closing waits for it.
    pub(super) fn give_up(&self, why: &str) {
        self.lost.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why.into());
        std::mem::forget((self.raw.clone(), self.queue.clone()));
    }
}

/// What first_run.wgsl computes.
fn mixed(i: u32) -> u32 {
    (i + 1).wrapping_mul(2_654_435_761) ^ 0x5bd1_e995
}

/// The decision of [`Device::open_or_skip`].
fn skipped(opened: Result<Device>) -> Result<Option<Device>> {
    match opened {
        Err(e) if e.kind() == Kind::NoAdapter => {
            let line = "=".repeat(80);
            eprintln!("{line}\nSKIPPED: NO SHADER WAS TESTED. {e}\n{line}");
            Ok(None)
        }
        other => other.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_machine_without_any_adapter_is_skipped() {
        let refused = |kind| skipped(Err(Error::new(kind, "refused"))).map(|d| d.is_none());
        assert_eq!(refused(Kind::NoAdapter), Ok(true));
        for kind in [Kind::WrongAdapter, Kind::Refused, Kind::Lost, Kind::TimedOut] {
            assert_eq!(refused(kind).unwrap_err().kind(), kind);
        }
    }
}
