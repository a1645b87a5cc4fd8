//! In: a password. Out: its Argon2id hash as a PHC string, and whether a password matches such a hash.
//! Frame and unit: none.

use argon2::Argon2;
use argon2::password_hash::{PasswordHash, PasswordHasher, PasswordVerifier, SaltString};
use sheetlight::fault::{Fault, Result};

/// Fewest characters of a password: shorter ones can be guessed.
const SHORTEST: usize = 10;
/// Most characters of a password: longer ones are a mistake, and cost time.
const LONGEST: usize = 256;

/// Hashes a new password. Returns an error if it is too short or too long.
pub fn hashed(password: &str) -> Result<String> {
    let length = password.chars().count();
    if !(SHORTEST..=LONGEST).contains(&length) {
        return Err(Fault::usage(format!("the password has {length} characters, {SHORTEST} to {LONGEST} are needed"))
            .next("choose another one, e.g. four words"));
    }
    let salt = SaltString::encode_b64(&rand::random::<[u8; 16]>()).expect("16 bytes are a salt");
    let hash = Argon2::default().hash_password(password.as_bytes(), &salt);
    Ok(hash
        .map_err(|e| Fault::device(format!("the password could not be hashed: {e}")).next("choose another one"))?
        .to_string())
}

/// Whether `password` matches the hash. Returns an error if `hash` is not a valid hash.
pub fn verify(password: &str, hash: &str) -> Result<bool> {
    let parsed = PasswordHash::new(hash.trim()).map_err(|e| {
        Fault::input(format!("the password file contains no Argon2 hash: {e}"))
            .cause("another file, or the password itself")
            .next("make one with sheetlight station password --out FILE")
    })?;
    Ok(password.chars().count() <= LONGEST && Argon2::default().verify_password(password.as_bytes(), &parsed).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_known_by_its_hash_alone() {
        let hash = hashed("correct horse battery").unwrap();
        assert!(hash.starts_with("$argon2id$") && !hash.contains("horse"));
        assert!(verify("correct horse battery", &hash).unwrap() && !verify("correct horse batterz", &hash).unwrap());
        assert!(hashed("short").is_err() && verify("x", "correct horse battery").is_err());
    }
}
