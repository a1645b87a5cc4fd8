//! In: a buffer. Out: a part of it that stages can bind: (buffer, byte offset, bytes). Frame and unit: bytes.

use crate::gpu::Buffer;

pub(in crate::stages) type Part<'a> = (&'a Buffer, u64, u64);

pub(in crate::stages) fn whole(b: &Buffer) -> Part<'_> {
    (b, 0, b.bytes.max(16).next_multiple_of(16))
}
