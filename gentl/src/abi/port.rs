//! Ports: registers and descriptions of every module.

use super::value::{Info, must_be, no_info, put, put_bytes, put_text};
use super::{Any, Handle, Text};
use crate::library;
use crate::modules::{MODEL, Port, TYPE, VENDOR, VERSION};
use crate::standard::error;
use crate::status::{Result, guard, refuse};
use std::path::Path;

/// Most bytes of one write; no register is longer.
const MOST_WRITTEN: usize = 0x1000;

/// The standard's PORT_REGISTER_STACK_ENTRY.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub struct StackEntry {
    address: u64,
    buffer: Any,
    size: usize,
}

fn port(handle: Handle) -> Result<Port> {
    Port::of(&library::object(handle)?)
}

/// # Safety
/// `buffer` is NULL or has `*size` bytes.
unsafe fn read(port: &Port, address: u64, buffer: Any, size: *mut usize) -> Result<()> {
    must_be(buffer)?;
    must_be(size)?;
    // SAFETY: not NULL, so the caller's own.
    let bytes = port.read(address, unsafe { size.read_unaligned() })?;
    // SAFETY: as the caller promises.
    unsafe { put_bytes(&bytes, buffer, size) }
}

/// # Safety
/// `buffer` is NULL or has `size` bytes.
unsafe fn write(port: &Port, address: u64, buffer: *const u8, size: usize) -> Result<()> {
    must_be(buffer)?;
    if size > MOST_WRITTEN {
        return refuse(error::INVALID_ADDRESS, format!("no register has {size} bytes"));
    }
    // SAFETY: as the caller promises.
    let bytes = unsafe { std::slice::from_raw_parts(buffer, size) }.to_vec();
    port.write(address, &bytes)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCReadPort(handle: Handle, address: u64, buffer: Any, size: *mut usize) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { read(&port(handle)?, address, buffer, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCWritePort(handle: Handle, address: u64, buffer: Any, size: *mut usize) -> i32 {
    guard(|| {
        let port = port(handle)?;
        must_be(size)?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { write(&port, address, buffer.cast(), size.read_unaligned()) }
    })
}

/// Runs `what` on each entry; `count` becomes the number of those that went well.
///
/// # Safety
/// `entries` is NULL or has `*count` entries.
unsafe fn stacked(
    entries: *mut StackEntry,
    count: *mut usize,
    mut what: impl FnMut(*mut StackEntry) -> Result<()>,
) -> Result<()> {
    must_be(entries)?;
    must_be(count)?;
    // SAFETY: not NULL, so the caller's own.
    let all = unsafe { count.read_unaligned() };
    for i in 0..all {
        // SAFETY: the caller has that many entries.
        if let Err(refusal) = what(unsafe { entries.add(i) }) {
            // SAFETY: not NULL, so the caller's own.
            unsafe { count.write_unaligned(i) };
            return Err(refusal);
        }
    }
    Ok(())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCReadPortStacked(handle: Handle, entries: *mut StackEntry, count: *mut usize) -> i32 {
    guard(|| {
        let port = port(handle)?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe {
            stacked(entries, count, |at| {
                let entry = at.read_unaligned();
                let mut size = entry.size;
                read(&port, entry.address, entry.buffer, &mut size)?;
                at.write_unaligned(StackEntry { size, ..entry });
                Ok(())
            })
        }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCWritePortStacked(handle: Handle, entries: *mut StackEntry, count: *mut usize) -> i32 {
    guard(|| {
        let port = port(handle)?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe {
            stacked(entries, count, |at| {
                let entry = at.read_unaligned();
                write(&port, entry.address, entry.buffer.cast(), entry.size)
            })
        }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetPortInfo(
    handle: Handle,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        let port = port(handle)?;
        let info = match command {
            0 => Info::Text(port.id),
            1 => Info::Text(VENDOR.into()),
            2 => Info::Text(MODEL.into()),
            3 => Info::Text(TYPE.into()),
            4 => Info::Text(port.module.into()),
            5 | 7 | 8 => Info::Bool(true),
            6 | 9 | 10 => Info::Bool(false),
            11 => Info::Text(VERSION.into()),
            12 => Info::Text("Device".into()),
            other => no_info(other)?,
        };
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetPortURL(handle: Handle, url: Text, size: *mut usize) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { put_text(&port(handle)?.url(), url, size) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetNumPortURLs(handle: Handle, count: *mut u32) -> i32 {
    // SAFETY: the pointer is the caller's own or NULL.
    guard(|| port(handle).and_then(|_| unsafe { put(1, count) }))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCGetPortURLInfo(
    handle: Handle,
    index: u32,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        let port = port(handle)?;
        if index > 0 {
            return refuse(error::INVALID_INDEX, format!("URL {index} is asked for, there is only URL 0"));
        }
        let info = match command {
            0 => Info::Text(port.url()),
            1 | 2 => Info::I32(1),
            3 => Info::I32(1),
            4 | 5 => Info::I32(0),
            6 => return refuse(error::NOT_AVAILABLE, "no hash of the description is given"),
            7 => Info::U64(crate::features::XML_AT),
            8 => Info::U64(port.described.xml.len() as u64),
            9 => Info::I32(0),
            10 => Info::Text(Path::new(&port.file()).display().to_string()),
            other => no_info(other)?,
        };
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}
