//! Events: filled buffers and errors.

use super::value::{Info, must_be, no_info, put, put_bytes};
use super::{Any, Handle};
use crate::buffer::place;
use crate::event::{Event, Message};
use crate::library::{self, Object};
use crate::standard::{error, event as kinds};
use crate::status::{Result, guard, refuse};
use std::sync::Arc;

/// Longest event: number and text of an error.
const MOST_BYTES: usize = 4096;

fn event(handle: Handle) -> Result<Arc<Event>> {
    match library::object(handle)? {
        Object::Event(event) => Ok(event),
        _ => refuse(error::INVALID_HANDLE, "the handle is not that of an event"),
    }
}

/// Puts an event where its module reports to, or takes it away.
fn attach(module: &Object, kind: i32, event: Option<Arc<Event>>) -> Result<()> {
    match (module, kind) {
        (Object::Stream(stream), kinds::NEW_BUFFER) => stream.with(|s| {
            match event {
                Some(event) => s.register(event),
                None => s.unregister(),
            }
            Ok(())
        }),
        (Object::Stream(stream), _) => stream.with(|s| {
            s.errors = event;
            Ok(())
        }),
        (Object::Device(camera), _) => {
            *camera.errors() = event;
            Ok(())
        }
        _ => Ok(()),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn GCRegisterEvent(module: Handle, kind: i32, handle: *mut Handle) -> i32 {
    guard(|| {
        let object = library::object(module)?;
        must_be(handle)?;
        match (&object, kind) {
            (Object::Event(_), _) => return refuse(error::INVALID_HANDLE, "an event has no events"),
            (Object::Stream(_), kinds::NEW_BUFFER) | (_, kinds::ERROR) => {}
            (_, kinds::ERROR..=kinds::MODULE) => {
                return refuse(error::NOT_IMPLEMENTED, format!("the module reports no events of kind {kind}"));
            }
            _ => return refuse(error::INVALID_PARAMETER, format!("there are no events of kind {kind}")),
        }
        let event = Arc::new(Event::new(kind));
        let opened = library::with(|library| {
            library.only_one(module, "the event", |o| matches!(o, Object::Event(e) if e.kind == kind))?;
            Ok(library.hold(module, Object::Event(event.clone())))
        })?;
        attach(&object, kind, Some(event))?;
        // SAFETY: the pointer is the caller's own or NULL.
        unsafe { put(opened, handle) }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn GCUnregisterEvent(module: Handle, kind: i32) -> i32 {
    guard(|| {
        let object = library::object(module)?;
        let taken = library::with(|library| {
            let found = library.children(module).find(|(_, o)| matches!(o, Object::Event(e) if e.kind == kind));
            match found.map(|(handle, _)| handle) {
                Some(handle) => Ok(library.take(handle)),
                None => refuse(error::INVALID_PARAMETER, format!("no event of kind {kind} is registered")),
            }
        })?;
        attach(&object, kind, None)?;
        for object in taken {
            if let Object::Event(event) = object {
                event.close();
            }
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn EventGetData(handle: Handle, buffer: Any, size: *mut usize, timeout_ms: u64) -> i32 {
    guard(|| {
        let event = event(handle)?;
        must_be(buffer)?;
        must_be(size)?;
        // SAFETY: not NULL, so the caller's own.
        let message = event.wait(timeout_ms, unsafe { size.read_unaligned() })?;
        if let Message::Buffer(buffer) = &message {
            buffer.put(place::IDLE);
        }
        // SAFETY: the pointers are the caller's own; the message fits.
        unsafe { put_bytes(&message.bytes(), buffer, size) }
    })
}

/// What an event's bytes say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn EventGetDataInfo(
    handle: Handle,
    data: *const u8,
    length: usize,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        let event = event(handle)?;
        must_be(data)?;
        if length > MOST_BYTES {
            return refuse(error::INVALID_PARAMETER, format!("no event has {length} bytes"));
        }
        // SAFETY: the caller's memory has that many bytes.
        let data = unsafe { std::slice::from_raw_parts(data, length) }.to_vec();
        let short = || refuse(error::INVALID_PARAMETER, format!("{length} bytes are too few for an event"));
        let info = if event.kind == kinds::NEW_BUFFER {
            let number = |at: usize| data.get(at..at + 8).map(|b| usize::from_ne_bytes(b.try_into().expect("eight")));
            let (Some(buffer), Some(user)) = (number(0), number(8)) else { return short() };
            match command {
                0 => Info::Pointer(buffer),
                1 => Info::Pointer(user),
                other => no_info(other)?,
            }
        } else {
            let Some((code, text)) = data.split_first_chunk::<4>() else { return short() };
            let code = i32::from_ne_bytes(*code);
            match command {
                0 => Info::Text(code.to_string()),
                1 => Info::Text(String::from_utf8_lossy(text).trim_end_matches('\0').to_owned()),
                2 => Info::U64(u64::from(code.unsigned_abs())),
                other => no_info(other)?,
            }
        };
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn EventGetInfo(
    handle: Handle,
    command: i32,
    kind: *mut i32,
    buffer: Any,
    size: *mut usize,
) -> i32 {
    guard(|| {
        let event = event(handle)?;
        let bytes = if event.kind == kinds::NEW_BUFFER { 2 * size_of::<usize>() } else { MOST_BYTES };
        let info = match command {
            0 => Info::I32(event.kind),
            1 => Info::Size(event.waiting()),
            2 => Info::U64(event.fired()),
            3 | 4 => Info::Size(bytes),
            other => no_info(other)?,
        };
        // SAFETY: the pointers are the caller's own or NULL.
        unsafe { info.put(kind, buffer, size) }
    })
}

/// Drops what waits; buffers are the program's again.
#[unsafe(no_mangle)]
pub extern "C" fn EventFlush(handle: Handle) -> i32 {
    guard(|| {
        for message in event(handle)?.drain() {
            if let Message::Buffer(buffer) = message {
                buffer.put(place::IDLE);
            }
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn EventKill(handle: Handle) -> i32 {
    guard(|| {
        event(handle)?.kill();
        Ok(())
    })
}
