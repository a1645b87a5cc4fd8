//! In: handles that a program holds. Out: what they stand for. A handle is a number that is never used again, so an
//! unknown or closed one is recognised.

use crate::camera::Camera;
use crate::config::{self, Entry};
use crate::event::Event;
use crate::standard::error;
use crate::status::{Result, refuse};
use crate::stream::Acquirer;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicI64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// The one interface's identifier.
pub const INTERFACE: &str = "sheetlight";

/// What a handle stands for.
#[derive(Clone)]
pub enum Object {
    System,
    Interface(Arc<Interface>),
    Device(Arc<Camera>),
    /// The port of the remote device.
    Remote(Arc<Camera>),
    Stream(Arc<Acquirer>),
    Event(Arc<Event>),
}

#[derive(Default)]
pub struct Interface {
    /// The device whose values the interface's features show.
    pub selected: AtomicI64,
}

struct Held {
    parent: usize,
    object: Object,
}

/// Everything that is open.
#[derive(Default)]
pub struct Library {
    held: BTreeMap<usize, Held>,
    /// The list of devices as it was read last.
    pub devices: Vec<Entry>,
}

static LIBRARY: Mutex<Option<Library>> = Mutex::new(None);
static NEXT: AtomicUsize = AtomicUsize::new(0x5348_0000);

/// A handle that was never given before.
pub fn new_handle() -> usize {
    NEXT.fetch_add(16, Ordering::Relaxed)
}

pub fn open() -> Result<()> {
    let mut library = LIBRARY.lock().unwrap_or_else(|e| e.into_inner());
    if library.is_some() {
        return refuse(error::RESOURCE_IN_USE, "GCInitLib was called already");
    }
    *library = Some(Library::default());
    Ok(())
}

/// Closes everything that is open.
pub fn close() -> Result<()> {
    let library = LIBRARY.lock().unwrap_or_else(|e| e.into_inner()).take();
    match library {
        Some(library) => {
            shut(library.held.into_values().map(|h| h.object));
            Ok(())
        }
        None => not_initialized(),
    }
}

fn not_initialized<T>() -> Result<T> {
    refuse(error::NOT_INITIALIZED, "GCInitLib was not called")
}

/// Runs `what` on the library. It must not wait for a thread.
pub fn with<T>(what: impl FnOnce(&mut Library) -> Result<T>) -> Result<T> {
    match &mut *LIBRARY.lock().unwrap_or_else(|e| e.into_inner()) {
        Some(library) => what(library),
        None => not_initialized(),
    }
}

/// What a handle stands for.
pub fn object(handle: usize) -> Result<Object> {
    with(|library| library.object(handle))
}

/// Ends what the objects do: waits end, threads end.
fn shut(objects: impl Iterator<Item = Object>) {
    let mut streams = Vec::new();
    for object in objects {
        match object {
            Object::Event(event) => event.close(),
            Object::Stream(stream) => streams.push(stream),
            _ => {}
        }
    }
    streams.iter().for_each(|s| s.close());
}

/// Closes a module and all that was opened from it, if it is of the kind that the function closes.
pub fn close_module(handle: usize, kind: impl FnOnce(&Object) -> bool) -> Result<()> {
    let closed = with(|library| {
        if !kind(&library.object(handle)?) {
            return refuse(error::INVALID_HANDLE, "the handle is of another kind of module");
        }
        Ok(library.take(handle))
    })?;
    shut(closed.into_iter());
    Ok(())
}

impl Library {
    fn object(&self, handle: usize) -> Result<Object> {
        match self.held.get(&handle) {
            Some(held) => Ok(held.object.clone()),
            None => refuse(error::INVALID_HANDLE, format!("{handle:#x} is not an open handle")),
        }
    }

    pub fn hold(&mut self, parent: usize, object: Object) -> usize {
        let handle = new_handle();
        self.held.insert(handle, Held { parent, object });
        handle
    }

    pub fn parent(&self, handle: usize) -> Option<usize> {
        self.held.get(&handle).map(|h| h.parent)
    }

    /// The objects that were opened from a module.
    pub fn children(&self, parent: usize) -> impl Iterator<Item = (usize, &Object)> {
        self.held.iter().filter(move |(_, h)| h.parent == parent).map(|(handle, h)| (*handle, &h.object))
    }

    /// Refuses what is open already.
    pub fn only_one(&self, parent: usize, what: &str, same: impl Fn(&Object) -> bool) -> Result<()> {
        if self.children(parent).any(|(_, object)| same(object)) {
            return refuse(error::RESOURCE_IN_USE, format!("{what} is open already"));
        }
        Ok(())
    }

    /// Takes an object and all that was opened from it.
    pub fn take(&mut self, handle: usize) -> Vec<Object> {
        let below: Vec<usize> = self.children(handle).map(|(child, _)| child).collect();
        let mut all: Vec<Object> = below.into_iter().flat_map(|child| self.take(child)).collect();
        all.extend(self.held.remove(&handle).map(|h| h.object));
        all
    }

    /// Reads the list of devices again; returns whether it changed.
    pub fn update_devices(&mut self) -> bool {
        let before = format!("{:?}", self.devices);
        self.devices = config::load();
        before != format!("{:?}", self.devices)
    }

    /// Whether a device is open.
    pub fn is_open(&self, id: &str) -> bool {
        self.held.values().any(|h| matches!(&h.object, Object::Device(camera) if camera.device.id == id))
    }

    pub fn device(&self, id: &str) -> Result<&Entry> {
        match self.devices.iter().find(|(device, _)| device.id == id) {
            Some(entry) => Ok(entry),
            None => {
                refuse(error::INVALID_ID, format!("no device has the id '{id}'; IFUpdateDeviceList reads the list"))
            }
        }
    }
}
