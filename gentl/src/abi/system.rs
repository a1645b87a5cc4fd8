//! The library, the transport layer and its one interface.

use super::value::{Info, must_be, no_info, put, put_text, text_at};
use super::{Any, Bool8, Handle, NONE, Text};
use crate::library::{self, INTERFACE, Interface, Object};
use crate::modules::{self, MODEL, TYPE, VENDOR, VERSION};
use crate::standard::{access, error};
use crate::status::{Result, guard, last, refuse};
use std::ffi::c_char;
use std::path::Path;

/// TL_CHAR_ENCODING_UTF8.
const UTF8: i32 = 1;

fn system_info(command: i32) -> Result<Info> {
    let path = modules::path();
    let name = || Path::new(&path).file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(match command {
        0 => Info::Text(INTERFACE.into()),
        1 => Info::Text(VENDOR.into()),
        2 | 7 => Info::Text(MODEL.into()),
        3 => Info::Text(VERSION.into()),
        4 => Info::Text(TYPE.into()),
        5 => Info::Text(name()),
        6 => Info::Text(path),
        8 => Info::I32(UTF8),
        9 => Info::U32(1),
        10 => Info::U32(5),
        other => return no_info(other),
    })
}

fn system(handle: Handle) -> Result<()> {
    match library::object(handle)? {
        Object::System => Ok(()),
        _ => refuse(error::INVALID_HANDLE, "the handle is not that of a transport layer"),
    }
}

fn interface(handle: Handle) -> Result<()> {
    match library::object(handle)? {
        Object::Interface(_) => Ok(()),
        _ => refuse(error::INVALID_HANDLE, "the handle is not that of an interface"),
    }
}

fn interface_id(id: &str) -> Result<()> {
    if id == INTERFACE { Ok(()) } else { refuse(error::INVALID_ID, format!("no interface has the id '{id}'")) }
}

fn interface_info(command: i32) -> Result<Info> {
    Ok(match command {
        0 => Info::Text(INTERFACE.into()),
        1 => Info::Text("Sheetlight scans".into()),
        2 => Info::Text(TYPE.into()),
        other => return no_info(other),
    })
}

fn device_info(id: &str, command: i32) -> Result<Info> {
    library::with(|library| {
        let entry = library.device(id)?;
        let device = &entry.0;
        Ok(match command {
            0 | 7 => Info::Text(device.id.clone()),
            1 => Info::Text(VENDOR.into()),
            2 => Info::Text(device.model().into()),
            3 => Info::Text(TYPE.into()),
            4 | 6 => Info::Text(device.shown_name().into()),
            5 => Info::I32(modules::status(library, entry)),
            8 => Info::Text(VERSION.into()),
            9 => Info::U64(1_000_000_000),
            other => return no_info(other),
        })
    })
}

/// An information about the producer; also before GCInitLib.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetInfo(command: i32, kind: *mut i32, buffer: Any, size: *mut usize) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { system_info(command)?.put(kind, buffer, size) })
}

/// Number and words of the last refusal in this thread; also before GCInitLib.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetLastError(code: *mut i32, text: Text, size: *mut usize) -> i32 {
    let (number, words) = last();
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { put(number, code).and_then(|()| put_text(&words, text, size)) })
}

#[unsafe(no_mangle)]
pub extern "C" fn GCInitLib() -> i32 {
    guard(library::open)
}

#[unsafe(no_mangle)]
pub extern "C" fn GCCloseLib() -> i32 {
    guard(library::close)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLOpen(handle: *mut Handle) -> i32 {
    guard(|| {
        let opened = library::with(|library| {
            must_be(handle)?;
            library.only_one(NONE, "the transport layer", |_| true)?;
            Ok(library.hold(NONE, Object::System))
        })?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(opened, handle) }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn TLClose(handle: Handle) -> i32 {
    guard(|| library::close_module(handle, |o| matches!(o, Object::System)))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLGetInfo(handle: Handle, command: i32, kind: *mut i32, buffer: Any, size: *mut usize) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { system(handle).and_then(|()| system_info(command))?.put(kind, buffer, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLGetNumInterfaces(handle: Handle, count: *mut u32) -> i32 {
    // SAFETY: the pointer is the caller's own or NULL.
    guard(|| unsafe { system(handle).and_then(|()| put(1, count)) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLGetInterfaceID(handle: Handle, index: u32, id: Text, size: *mut usize) -> i32 {
    guard(|| {
        system(handle)?;
        if index > 0 {
            return refuse(error::INVALID_INDEX, format!("interface {index} is asked for, there is only interface 0"));
        }
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { put_text(INTERFACE, id, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLGetInterfaceInfo(
    handle: Handle,
    id: *const c_char,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        system(handle)?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe {
            interface_id(&text_at(id)?)?;
            interface_info(command)?.put(kind, buffer, size)
        }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLOpenInterface(handle: Handle, id: *const c_char, opened: *mut Handle) -> i32 {
    guard(|| {
        system(handle)?;
        // SAFETY: the pointer is the caller's own or NULL.
        interface_id(&unsafe { text_at(id) }?)?;
        must_be(opened)?;
        let new = library::with(|library| {
            library.only_one(handle, "the interface", |o| matches!(o, Object::Interface(_)))?;
            library.update_devices();
            Ok(library.hold(handle, Object::Interface(Interface::default().into())))
        })?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(new, opened) }
    })
}

/// There is always the same interface.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn TLUpdateInterfaceList(handle: Handle, changed: *mut Bool8, _timeout_ms: u64) -> i32 {
    guard(|| {
        system(handle)?;
        // SAFETY: not NULL, so the caller's own.
        if changed.is_null() { Ok(()) } else { unsafe { put(0, changed) } }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn IFClose(handle: Handle) -> i32 {
    guard(|| library::close_module(handle, |o| matches!(o, Object::Interface(_))))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFGetInfo(handle: Handle, command: i32, kind: *mut i32, buffer: Any, size: *mut usize) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { interface(handle).and_then(|()| interface_info(command))?.put(kind, buffer, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFGetParentTL(handle: Handle, parent: *mut Handle) -> i32 {
    guard(|| {
        interface(handle)?;
        let found = library::with(|l| Ok(l.parent(handle).unwrap_or(NONE)))?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(found, parent) }
    })
}

/// Reads the list of devices again. A list that cannot be read is one device without access.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFUpdateDeviceList(handle: Handle, changed: *mut Bool8, _timeout_ms: u64) -> i32 {
    guard(|| {
        interface(handle)?;
        let other = library::with(|library| Ok(library.update_devices()))?;
        // SAFETY: not NULL, so the caller's own.
        if changed.is_null() { Ok(()) } else { unsafe { put(u8::from(other), changed) } }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFGetNumDevices(handle: Handle, count: *mut u32) -> i32 {
    guard(|| {
        interface(handle)?;
        let devices = library::with(|library| Ok(library.devices.len() as u32))?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(devices, count) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFGetDeviceID(handle: Handle, index: u32, id: Text, size: *mut usize) -> i32 {
    guard(|| {
        interface(handle)?;
        let found = library::with(|library| match library.devices.get(index as usize) {
            Some((device, _)) => Ok(device.id.clone()),
            None => {
                let count = library.devices.len();
                refuse(error::INVALID_INDEX, format!("device {index} is asked for, there are {count}"))
            }
        })?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { put_text(&found, id, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFGetDeviceInfo(
    handle: Handle,
    id: *const c_char,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        interface(handle)?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { device_info(&text_at(id)?, command)?.put(kind, buffer, size) }
    })
}

/// Opens a device for control; nobody else can open it until it is closed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn IFOpenDevice(handle: Handle, id: *const c_char, flags: i32, opened: *mut Handle) -> i32 {
    guard(|| {
        interface(handle)?;
        // SAFETY: the pointer is the caller's own or NULL.
        let id = unsafe { text_at(id) }?;
        must_be(opened)?;
        if !(access::CONTROL..=access::EXCLUSIVE).contains(&flags) {
            return refuse(error::NOT_IMPLEMENTED, "devices are opened with control or exclusive access only");
        }
        let new = super::device::open(handle, &id)?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(new, opened) }
    })
}
