//! In: a value and the pointers that a program gave for it. Out: the value there, or the size that it needs.

use super::{Any, Text};
use crate::standard::{datatype, error};
use crate::status::{Result, refuse};
use std::ffi::{CStr, c_char};

/// Longest text that is read from a program.
const MOST_TEXT: usize = 4096;

/// An information with its type.
pub enum Info {
    Text(String),
    Bool(bool),
    I32(i32),
    U32(u32),
    U64(u64),
    Size(usize),
    Pointer(usize),
}

impl Info {
    fn kind(&self) -> i32 {
        match self {
            Info::Text(_) => datatype::STRING,
            Info::Bool(_) => datatype::BOOL8,
            Info::I32(_) => datatype::INT32,
            Info::U32(_) => datatype::UINT32,
            Info::U64(_) => datatype::UINT64,
            Info::Size(_) => datatype::SIZET,
            Info::Pointer(_) => datatype::PTR,
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Info::Text(text) => [text.as_bytes(), &[0]].concat(),
            Info::Bool(b) => vec![u8::from(*b)],
            Info::I32(n) => n.to_ne_bytes().to_vec(),
            Info::U32(n) => n.to_ne_bytes().to_vec(),
            Info::U64(n) => n.to_ne_bytes().to_vec(),
            Info::Size(n) | Info::Pointer(n) => n.to_ne_bytes().to_vec(),
        }
    }

    /// Gives type and value; a NULL `buffer` asks for the size.
    ///
    /// # Safety
    /// `kind` is NULL or writable, `size` too, and `buffer` is NULL or has `*size` bytes.
    pub unsafe fn put(&self, kind: *mut i32, buffer: Any, size: *mut usize) -> Result<()> {
        if !kind.is_null() {
            // SAFETY: not NULL, so the caller's own; any alignment.
            unsafe { kind.write_unaligned(self.kind()) };
        }
        // SAFETY: as the caller promises.
        unsafe { put_bytes(&self.bytes(), buffer, size) }
    }
}

/// Copies bytes into a program's memory; a NULL `buffer` asks for the size.
///
/// # Safety
/// `size` is NULL or writable, and `buffer` is NULL or has `*size` bytes.
pub unsafe fn put_bytes(bytes: &[u8], buffer: Any, size: *mut usize) -> Result<()> {
    if size.is_null() {
        return refuse(error::INVALID_PARAMETER, "the pointer to the size is NULL");
    }
    // SAFETY: not NULL, so the caller's own; any alignment.
    let room = unsafe { size.read_unaligned() };
    // SAFETY: the same.
    unsafe { size.write_unaligned(bytes.len()) };
    if buffer.is_null() {
        return Ok(());
    }
    if room < bytes.len() {
        return refuse(error::BUFFER_TOO_SMALL, format!("{} bytes are needed, {room} given", bytes.len()));
    }
    // SAFETY: the caller's memory has `room` bytes, which are enough; ours cannot overlap it.
    unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), buffer.cast(), bytes.len()) };
    Ok(())
}

/// Gives a text.
///
/// # Safety
/// As [`put_bytes`].
pub unsafe fn put_text(text: &str, buffer: Text, size: *mut usize) -> Result<()> {
    // SAFETY: as the caller promises.
    unsafe { put_bytes(&[text.as_bytes(), &[0]].concat(), buffer.cast(), size) }
}

/// Gives a number or a handle.
///
/// # Safety
/// `out` is NULL or writable.
pub unsafe fn put<T>(value: T, out: *mut T) -> Result<()> {
    if out.is_null() {
        return refuse(error::INVALID_PARAMETER, "the pointer to the result is NULL");
    }
    // SAFETY: not NULL, so the caller's own; any alignment.
    unsafe { out.write_unaligned(value) };
    Ok(())
}

/// Refuses a NULL pointer before anything is done.
pub fn must_be<T>(out: *const T) -> Result<()> {
    if out.is_null() { refuse(error::INVALID_PARAMETER, "a pointer is NULL") } else { Ok(()) }
}

/// Reads a text.
///
/// # Safety
/// `text` is NULL or ends with a 0.
pub unsafe fn text_at(text: *const c_char) -> Result<String> {
    must_be(text)?;
    // SAFETY: as the caller promises.
    let bytes = unsafe { CStr::from_ptr(text) }.to_bytes();
    let short = bytes.get(..MOST_TEXT).unwrap_or(bytes);
    Ok(String::from_utf8_lossy(short).into_owned())
}

/// Refuses an information that the module does not have.
pub fn no_info(command: i32) -> Result<Info> {
    refuse(error::NOT_IMPLEMENTED, format!("there is no information {command}"))
}
