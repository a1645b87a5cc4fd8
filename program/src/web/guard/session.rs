//! In: the token of this program start, a password. Out: sessions identified by a cookie; a program may send the
//! token itself.
//! Frame and unit: seconds.

use rand::TryRngCore;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Most sessions at a time; a new one replaces the one that was used longest ago.
const MOST: usize = 256;
/// A session that is unused for this long is over.
const LONGEST_IDLE: Duration = Duration::from_secs(12 * 3600);

/// Clients that may talk to this start of the program.
pub struct Sessions {
    /// Hash of the token: comparing hashes does not reveal by its duration how much of a token is right.
    token: [u8; 32],
    open: Mutex<HashMap<[u8; 32], Instant>>,
}

/// 32 hexadecimal digits from the system's random generator.
pub fn random_hex() -> String {
    let mut bytes = [0u8; 16];
    rand::rngs::OsRng.try_fill_bytes(&mut bytes).expect("the system gives random bytes");
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

fn hash(text: &str) -> [u8; 32] {
    Sha256::digest(text.as_bytes()).into()
}

impl Sessions {
    /// No sessions yet; `token` opens them.
    pub fn new(token: &str) -> Sessions {
        Sessions { token: hash(token), open: Mutex::default() }
    }

    /// Whether this is the token of this start.
    pub fn is_token(&self, given: &str) -> bool {
        hash(given) == self.token
    }

    /// Opens a session; returns its name, which goes into the cookie.
    pub fn open(&self) -> String {
        let name = random_hex();
        let mut open = self.open.lock().unwrap_or_else(|e| e.into_inner());
        open.retain(|_, used| used.elapsed() < LONGEST_IDLE);
        while open.len() >= MOST {
            let oldest = open.iter().min_by_key(|(_, used)| **used).map(|(k, _)| *k);
            open.remove(&oldest.expect("not empty"));
        }
        open.insert(hash(&name), Instant::now());
        name
    }

    /// Whether a cookie's session is open; counts as use of the session.
    pub fn knows(&self, name: &str) -> bool {
        let mut open = self.open.lock().unwrap_or_else(|e| e.into_inner());
        match open.get_mut(&hash(name)) {
            Some(used) if used.elapsed() < LONGEST_IDLE => {
                *used = Instant::now();
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sessions_are_opened_by_this_start_and_bounded() {
        let sessions = Sessions::new("t");
        assert!(sessions.is_token("t") && !sessions.is_token("") && !sessions.is_token("u"));
        let first = sessions.open();
        assert!(sessions.knows(&first) && !sessions.knows("") && !sessions.knows("t"));
        let names: Vec<String> = (0..MOST).map(|_| sessions.open()).collect();
        assert!(!sessions.knows(&first) && sessions.knows(&names[MOST - 1]));
        assert!(!Sessions::new("t").knows(&names[0]), "another start knows none of them");
    }
}
