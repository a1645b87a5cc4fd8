//! Data streams: buffers, acquisition, what a buffer holds.

use super::value::{Info, must_be, no_info, put};
use super::{Any, Handle, NONE};
use crate::buffer::{Buffer, Content, place};
use crate::library::{self, Object, new_handle};
use crate::modules::{STREAM, TYPE};
use crate::settings::Part;
use crate::standard::{component, error, payload};
use crate::status::{Result, guard, refuse};
use crate::stream::{Acquirer, Stream};
use std::sync::Arc;
use std::sync::atomic::{AtomicPtr, AtomicU8, Ordering};

/// Most buffers of a stream.
const MOST_BUFFERS: usize = 4096;
/// Parts of buffers begin there when a program gives its memory at such a multiple.
const ALIGNMENT: usize = 16;

/// Kinds of ACQ_QUEUE_TYPE.
mod flush {
    pub const INPUT_TO_OUTPUT: i32 = 0;
    pub const OUTPUT_DISCARD: i32 = 1;
    pub const ALL_TO_INPUT: i32 = 2;
    pub const UNQUEUED_TO_INPUT: i32 = 3;
    pub const ALL_DISCARD: i32 = 4;
}

fn stream(handle: Handle) -> Result<Arc<Acquirer>> {
    match library::object(handle)? {
        Object::Stream(stream) => Ok(stream),
        _ => refuse(error::INVALID_HANDLE, "the handle is not that of a data stream"),
    }
}

fn buffer(stream: &Stream, handle: Handle) -> Result<Arc<Buffer>> {
    match stream.buffers.get(&handle) {
        Some(buffer) => Ok(buffer.clone()),
        None => refuse(error::INVALID_HANDLE, format!("{handle:#x} is not a buffer of this stream")),
    }
}

fn buffer_of(handle: Handle, buffer_handle: Handle) -> Result<Arc<Buffer>> {
    stream(handle)?.with(|s| buffer(s, buffer_handle))
}

/// # Safety
/// `out` is NULL or writable.
unsafe fn announce(
    handle: Handle,
    memory: (*mut u8, usize, Option<Box<[u8]>>),
    user: Any,
    out: *mut Handle,
) -> Result<()> {
    let (address, size, own) = memory;
    let new = stream(handle)?.with(|s| {
        if s.buffers.len() >= MOST_BUFFERS {
            let what = format!("{MOST_BUFFERS} buffers are announced already");
            return refuse(error::RESOURCE_EXHAUSTED, what);
        }
        let new = new_handle();
        let buffer = Buffer {
            handle: new,
            address: AtomicPtr::new(address),
            size,
            user: user as usize,
            own,
            place: AtomicU8::new(place::IDLE),
            content: Default::default(),
        };
        s.buffers.insert(new, Arc::new(buffer));
        Ok(new)
    })?;
    // SAFETY: as the caller promises.
    unsafe { put(new, out) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSAnnounceBuffer(
    handle: Handle,
    memory: Any,
    size: usize,
    user: Any,
    buffer: *mut Handle,
) -> i32 {
    guard(|| {
        stream(handle)?;
        must_be(memory)?;
        must_be(buffer)?;
        if size == 0 || size > isize::MAX as usize {
            return refuse(error::INVALID_PARAMETER, format!("a buffer of {size} bytes"));
        }
        // SAFETY: the pointer is the caller's own.
        unsafe { announce(handle, (memory.cast(), size, None), user, buffer) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSAllocAndAnnounceBuffer(handle: Handle, size: usize, user: Any, buffer: *mut Handle) -> i32 {
    guard(|| {
        stream(handle)?;
        must_be(buffer)?;
        if size == 0 {
            return refuse(error::INVALID_PARAMETER, "a buffer of 0 bytes");
        }
        let mut memory: Vec<u8> = Vec::new();
        if memory.try_reserve_exact(size).is_err() {
            return refuse(error::OUT_OF_MEMORY, format!("a buffer of {size} bytes cannot be allocated"));
        }
        memory.resize(size, 0);
        let mut memory = memory.into_boxed_slice();
        let address = memory.as_mut_ptr();
        // SAFETY: the pointer is the caller's own.
        unsafe { announce(handle, (address, size, Some(memory)), user, buffer) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSRevokeBuffer(
    handle: Handle,
    buffer_handle: Handle,
    memory: *mut Any,
    user: *mut Any,
) -> i32 {
    guard(|| {
        let taken = stream(handle)?.with(|s| {
            let buffer = buffer(s, buffer_handle)?;
            if !buffer.is_at(place::IDLE) {
                return refuse(error::BUSY, "the buffer is in a queue: DSFlushQueue takes it out");
            }
            s.buffers.remove(&buffer_handle);
            Ok(buffer)
        })?;
        // Memory of this library goes with the buffer.
        let address = if taken.own.is_some() { std::ptr::null_mut() } else { taken.address.load(Ordering::Relaxed) };
        for (out, value) in [(memory, address.cast()), (user, taken.user as Any)] {
            if !out.is_null() {
                // SAFETY: not NULL, so the caller's own.
                unsafe { put(value, out) }?;
            }
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn DSQueueBuffer(handle: Handle, buffer_handle: Handle) -> i32 {
    guard(|| {
        stream(handle)?.with(|s| {
            let buffer = buffer(s, buffer_handle)?;
            if !buffer.is_at(place::IDLE) {
                return refuse(error::BUSY, "the buffer is in a queue already");
            }
            s.queue(buffer);
            Ok(())
        })
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn DSFlushQueue(handle: Handle, operation: i32) -> i32 {
    guard(|| {
        stream(handle)?.with(|s| {
            match operation {
                flush::INPUT_TO_OUTPUT => {
                    for buffer in s.take_input() {
                        *buffer.content.lock().unwrap_or_else(|e| e.into_inner()) = Content::default();
                        s.give(buffer);
                    }
                }
                flush::OUTPUT_DISCARD => drop(s.take_output()),
                flush::ALL_TO_INPUT | flush::UNQUEUED_TO_INPUT => {
                    if operation == flush::ALL_TO_INPUT {
                        s.take_output();
                    }
                    let idle: Vec<_> = s.buffers.values().filter(|b| b.is_at(place::IDLE)).cloned().collect();
                    idle.into_iter().for_each(|buffer| s.queue(buffer));
                }
                flush::ALL_DISCARD => {
                    s.take_input();
                    s.take_output();
                }
                other => return refuse(error::INVALID_PARAMETER, format!("there is no flush operation {other}")),
            }
            Ok(())
        })
    })
}

/// Starts the stream; frames come when the remote device is started too.
#[unsafe(no_mangle)]
pub extern "C" fn DSStartAcquisition(handle: Handle, flags: i32, count: u64) -> i32 {
    guard(|| {
        let stream = stream(handle)?;
        if flags != 0 {
            return refuse(error::INVALID_PARAMETER, format!("there are no start flags {flags}"));
        }
        if count == 0 {
            return refuse(error::INVALID_PARAMETER, "0 frames to acquire");
        }
        stream.with(|s| {
            if s.to_acquire.is_some() {
                return refuse(error::RESOURCE_IN_USE, "the acquisition is started already");
            }
            if s.buffers.is_empty() {
                return refuse(error::INVALID_PARAMETER, "no buffer is announced");
            }
            (s.to_acquire, s.delivered, s.started) = (Some(count), 0, 0);
            Ok(())
        })
    })
}

/// Stops the stream; a scan that is being made for a frame is given up.
#[unsafe(no_mangle)]
pub extern "C" fn DSStopAcquisition(handle: Handle, flags: i32) -> i32 {
    guard(|| {
        let stream = stream(handle)?;
        if !(0..=1).contains(&flags) {
            return refuse(error::INVALID_PARAMETER, format!("there are no stop flags {flags}"));
        }
        if stream.with(|s| Ok(s.to_acquire.is_none()))? {
            return refuse(error::RESOURCE_IN_USE, "the acquisition is not started");
        }
        stream.stop();
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetInfo(handle: Handle, command: i32, kind: *mut i32, buffer: Any, size: *mut usize) -> i32 {
    guard(|| {
        let acquirer = stream(handle)?;
        let bytes = acquirer.camera.state().settings.payload();
        let info = acquirer.with(|s| {
            Ok(match command {
                0 => Info::Text(STREAM.into()),
                1 => Info::U64(s.delivered),
                // The next frame waits for a buffer.
                2 => Info::U64(0),
                3 => Info::Size(s.buffers.len()),
                4 => Info::Size(s.input.len()),
                5 => Info::Size(s.awaiting()),
                6 => Info::U64(s.started),
                7 => Info::Size(bytes),
                8 => Info::Bool(s.to_acquire.is_some()),
                9 => Info::Bool(true),
                10 => Info::Text(TYPE.into()),
                11 => Info::Size(0),
                12 => Info::Size(1),
                13 => Info::Size(ALIGNMENT),
                other => no_info(other)?,
            })
        })?;
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetBufferID(handle: Handle, index: u32, buffer: *mut Handle) -> i32 {
    guard(|| {
        let found = stream(handle)?.with(|s| match s.buffers.keys().nth(index as usize) {
            Some(found) => Ok(*found),
            None => {
                let count = s.buffers.len();
                refuse(error::INVALID_INDEX, format!("buffer {index} is asked for, {count} are announced"))
            }
        })?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(found, buffer) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetParentDev(handle: Handle, parent: *mut Handle) -> i32 {
    guard(|| {
        stream(handle)?;
        let found = library::with(|l| Ok(l.parent(handle).unwrap_or(NONE)))?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(found, parent) }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn DSClose(handle: Handle) -> i32 {
    guard(|| library::close_module(handle, |o| matches!(o, Object::Stream(_))))
}

/// The one image of a buffer that has no parts.
fn image(content: &Content) -> Result<&Part> {
    match &content.parts[..] {
        [part] => Ok(part),
        [] => refuse(error::NOT_AVAILABLE, "the buffer holds no frame"),
        parts => refuse(
            error::NOT_AVAILABLE,
            format!("the buffer holds {} parts: DSGetBufferPartInfo tells about each", parts.len()),
        ),
    }
}

fn buffer_info(buffer: &Buffer, command: i32) -> Result<Info> {
    let content = buffer.content();
    let region = || match content.region {
        Some(region) => Ok(region),
        None => refuse(error::NOT_AVAILABLE, "the buffer holds no frame"),
    };
    let size = |n: u32| Info::Size(n as usize);
    Ok(match command {
        0 => Info::Pointer(buffer.address.load(Ordering::Relaxed) as usize),
        1 => Info::Size(buffer.size),
        2 => Info::Pointer(buffer.user),
        3 | 28 => Info::U64(content.timestamp_ns),
        4 => Info::Bool(content.new),
        5 => Info::Bool(!buffer.is_at(place::IDLE)),
        6 => Info::Bool(buffer.is_at(place::FILLING)),
        7 => Info::Bool(content.too_large),
        8 => Info::Text(TYPE.into()),
        9 | 27 => Info::Size(content.filled),
        10 => size(image(&content).and_then(|_| region())?.width),
        11 | 22 => size(image(&content).and_then(|_| region())?.height),
        12 => size(image(&content).and_then(|_| region())?.x),
        13 => size(image(&content).and_then(|_| region())?.y),
        14 | 15 => Info::Size(0),
        16 => Info::U64(content.frame_id),
        17 => Info::Bool(content.filled > 0),
        18 => Info::Size(image(&content)?.offset),
        19 => Info::Size(if content.parts.len() > 1 { payload::MULTI_PART } else { payload::IMAGE }),
        20 => Info::U64(image(&content)?.format as u64),
        21 => Info::U64(payload::PFNC_32BIT),
        23 => Info::Size(0),
        26 => Info::I32(payload::LITTLE_ENDIAN),
        29 => Info::Bool(content.too_large),
        30 => Info::Bool(false),
        other => no_info(other)?,
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetBufferInfo(
    handle: Handle,
    buffer_handle: Handle,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { buffer_info(&*buffer_of(handle, buffer_handle)?, command)?.put(kind, buffer, size) })
}

/// No buffer holds chunks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetBufferChunkData(
    handle: Handle,
    buffer_handle: Handle,
    _chunks: Any,
    count: *mut usize,
) -> i32 {
    guard(|| {
        buffer_of(handle, buffer_handle)?;
        must_be(count)?;
        refuse(error::NOT_AVAILABLE, "buffers hold no chunks")
    })
}

/// The parts of a multi-part buffer; 0 of a plain image.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetNumBufferParts(handle: Handle, buffer_handle: Handle, count: *mut u32) -> i32 {
    guard(|| {
        let parts = buffer_of(handle, buffer_handle)?.content().parts.len();
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(if parts > 1 { parts as u32 } else { 0 }, count) }
    })
}

fn part_info(buffer: &Buffer, index: u32, command: i32) -> Result<Info> {
    let content = buffer.content();
    let parts = if content.parts.len() > 1 { &content.parts[..] } else { &[] };
    let (Some(part), Some(region)) = (parts.get(index as usize), content.region) else {
        return refuse(error::INVALID_INDEX, format!("part {index} is asked for, there are {}", parts.len()));
    };
    let size = |n: u32| Info::Size(n as usize);
    Ok(match command {
        0 => Info::Pointer(buffer.address.load(Ordering::Relaxed) as usize + part.offset),
        1 => Info::Size(if content.too_large { 0 } else { part.bytes }),
        2 => Info::Size(match part.component {
            component::RANGE => payload::PART_3D_IMAGE,
            component::CONFIDENCE => payload::PART_CONFIDENCE_MAP,
            _ => payload::PART_2D_IMAGE,
        }),
        3 => Info::U64(part.format as u64),
        4 => Info::U64(payload::PFNC_32BIT),
        5 => size(region.width),
        6 | 11 => size(region.height),
        7 => size(region.x),
        8 => size(region.y),
        9 => Info::Size(0),
        // All parts are of the one sensor and the one region.
        10 | 12 => Info::U64(0),
        13 => Info::U64(part.component as u64),
        other => no_info(other)?,
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn DSGetBufferPartInfo(
    handle: Handle,
    buffer_handle: Handle,
    index: u32,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    // SAFETY: the pointers are the caller's own or NULL.
    guard(|| unsafe { part_info(&*buffer_of(handle, buffer_handle)?, index, command)?.put(kind, buffer, size) })
}
