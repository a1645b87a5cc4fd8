//! In: text. Out: the hash that identifies a file.
//! Frame and unit: none.

/// SHA-256 of bytes, hexadecimal.
pub fn hash_text(bytes: &[u8]) -> String {
    use sha2::Digest;
    hex(&sha2::Sha256::digest(bytes))
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
