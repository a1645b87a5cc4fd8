//! Devices: opening, the remote device's port, the data stream.

use super::value::{Info, must_be, no_info, put, put_text, text_at};
use super::{Any, Handle, NONE, Text};
use crate::camera::Camera;
use crate::library::{self, Object};
use crate::modules::{STREAM, TYPE, VENDOR, VERSION};
use crate::standard::{access, error};
use crate::status::{Refusal, Result, guard, refuse};
use crate::stream::Acquirer;
use std::ffi::c_char;
use std::sync::Arc;

fn device(handle: Handle) -> Result<Arc<Camera>> {
    match library::object(handle)? {
        Object::Device(camera) => Ok(camera),
        _ => refuse(error::INVALID_HANDLE, "the handle is not that of a device"),
    }
}

fn busy<T>(id: &str) -> Result<T> {
    refuse(error::RESOURCE_IN_USE, format!("the device {id} is open already"))
}

/// Opens a device; its folders are read without holding up other calls.
pub fn open(interface: Handle, id: &str) -> Result<Handle> {
    let (spec, origin) = library::with(|library| {
        if library.is_open(id) {
            return busy(id);
        }
        library.device(id).cloned()
    })?;
    let denied = |text: String| Refusal { code: error::ACCESS_DENIED, text };
    let origin = origin.map_err(|fault| denied(fault.to_string()))?;
    let camera = Arc::new(Camera::open(&spec, &origin).map_err(|refusal| denied(refusal.text))?);
    library::with(|library| {
        if library.is_open(id) {
            return busy(id);
        }
        if library.parent(interface).is_none() {
            return refuse(error::INVALID_HANDLE, "the interface was closed");
        }
        let device = library.hold(interface, Object::Device(camera.clone()));
        library.hold(device, Object::Remote(camera));
        Ok(device)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn DevClose(handle: Handle) -> i32 {
    guard(|| library::close_module(handle, |o| matches!(o, Object::Device(_))))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevGetInfo(
    handle: Handle,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        let camera = device(handle)?;
        let info = match command {
            0 | 7 => Info::Text(camera.device.id.clone()),
            1 => Info::Text(VENDOR.into()),
            2 => Info::Text(camera.device.model().into()),
            3 => Info::Text(TYPE.into()),
            4 | 6 => Info::Text(camera.device.shown_name().into()),
            5 => Info::I32(access::STATUS_OPEN_READWRITE),
            8 => Info::Text(VERSION.into()),
            9 => Info::U64(1_000_000_000),
            other => no_info(other)?,
        };
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevGetParentIF(handle: Handle, parent: *mut Handle) -> i32 {
    guard(|| {
        device(handle)?;
        let found = library::with(|l| Ok(l.parent(handle).unwrap_or(NONE)))?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(found, parent) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevGetPort(handle: Handle, port: *mut Handle) -> i32 {
    guard(|| {
        device(handle)?;
        let found = library::with(|library| {
            let mut children = library.children(handle);
            Ok(children.find(|(_, o)| matches!(o, Object::Remote(_))).map_or(NONE, |(remote, _)| remote))
        })?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(found, port) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevGetNumDataStreams(handle: Handle, count: *mut u32) -> i32 {
    // SAFETY: the pointer is the caller's own or NULL.
    guard(|| device(handle).and_then(|_| unsafe { put(1, count) }))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevGetDataStreamID(handle: Handle, index: u32, id: Text, size: *mut usize) -> i32 {
    guard(|| {
        device(handle)?;
        if index > 0 {
            return refuse(error::INVALID_INDEX, format!("stream {index} is asked for, there is only stream 0"));
        }
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { put_text(STREAM, id, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DevOpenDataStream(handle: Handle, id: *const c_char, stream: *mut Handle) -> i32 {
    guard(|| {
        let camera = device(handle)?;
        // SAFETY: the pointer is the caller's own or NULL.
        let id = unsafe { text_at(id) }?;
        must_be(stream)?;
        if id != STREAM {
            return refuse(error::INVALID_ID, format!("no data stream has the id '{id}'"));
        }
        let opened = library::with(|library| {
            library.only_one(handle, "the data stream", |o| matches!(o, Object::Stream(_)))?;
            if library.parent(handle).is_none() {
                return refuse(error::INVALID_HANDLE, "the device was closed");
            }
            Ok(library.hold(handle, Object::Stream(Acquirer::start(camera)?.into())))
        })?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(opened, stream) }
    })
}
