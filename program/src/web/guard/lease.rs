//! In: tabs that want to operate. Out: one of them operates; the others watch until it is idle for a minute or
//! releases the lease.
//! Frame and unit: seconds.

use crate::web::message::Lease;
use sheetlight::fault::{Fault, Result};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A tab without activity for this long stops operating.
pub const IDLE: Duration = Duration::from_secs(60);

/// Sender of a request: a browser's tab or a program, within a session.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Tab {
    /// Name of the session, or of the token.
    pub session: String,
    /// Name of the tab, from its header.
    pub tab: String,
}

impl Tab {
    /// A few characters by which people distinguish tabs; not a secret.
    pub fn short(&self) -> String {
        self.tab.chars().take(4).collect()
    }
}

struct Held {
    tab: Tab,
    used: Instant,
}

/// The only lease.
#[derive(Default)]
pub struct Leases(Mutex<Option<Held>>);

impl Leases {
    /// Takes or renews the lease. Returns an error while another tab holds it, unless `firmly`: a person at the
    /// machine may take it over. Returns true unless this tab already held a lease that is still valid.
    pub fn take(&self, tab: &Tab, firmly: bool) -> Result<bool> {
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        match &*held {
            Some(h) if h.tab != *tab && h.used.elapsed() < IDLE && !firmly => Err(Fault::refused(format!(
                "screen {} operates, for {:.0} s more without a touch",
                h.tab.short(),
                (IDLE - h.used.elapsed()).as_secs_f64()
            ))
            .cause("one operates, the others watch")
            .next("ask there, wait, or take over")),
            _ => {
                let renewed = held.as_ref().is_some_and(|h| h.tab == *tab && h.used.elapsed() < IDLE);
                *held = Some(Held { tab: tab.clone(), used: Instant::now() });
                Ok(!renewed)
            }
        }
    }

    /// Returns an error for a tab that does not hold the lease; renews the lease of the tab that does.
    pub fn need(&self, tab: &Tab) -> Result<()> {
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        match &mut *held {
            Some(h) if h.tab == *tab && h.used.elapsed() < IDLE => {
                h.used = Instant::now();
                Ok(())
            }
            _ => Err(Fault::refused("this screen only watches")
                .cause("another one operates, or this one was idle for 60 s")
                .next("press Operate")),
        }
    }

    /// Whether this tab operates; its lease is not renewed.
    pub fn holds(&self, tab: &Tab) -> bool {
        let held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        held.as_ref().is_some_and(|h| h.tab == *tab && h.used.elapsed() < IDLE)
    }

    /// Releases the lease.
    pub fn release(&self, tab: &Tab) {
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if held.as_ref().is_some_and(|h| h.tab == *tab) {
            *held = None;
        }
    }

    /// The holder, in the form that every viewer may see.
    pub fn state(&self) -> Lease {
        let held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        match held.as_ref().filter(|h| h.used.elapsed() < IDLE) {
            Some(h) => {
                Lease { holder: Some(h.tab.short()), seconds_left: (IDLE - h.used.elapsed()).as_secs_f64().round() }
            }
            None => Lease::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_operates() {
        let tab = |t: &str| Tab { session: "s".into(), tab: t.into() };
        let leases = Leases::default();
        assert!(leases.need(&tab("a")).is_err());
        leases.take(&tab("a"), false).unwrap();
        leases.need(&tab("a")).unwrap();
        assert!(leases.need(&tab("b")).is_err() && leases.take(&tab("b"), false).is_err());
        leases.release(&tab("b"));
        assert_eq!(leases.state().holder.as_deref(), Some("a"));
        assert!(leases.take(&tab("b"), true).unwrap() && !leases.take(&tab("b"), false).unwrap());
        // Tabs whose names begin alike are different tabs.
        assert!(leases.take(&tab("operator1"), true).unwrap() && leases.take(&tab("operator2"), true).unwrap());
        leases.take(&tab("b"), true).unwrap();
        assert!(leases.need(&tab("a")).is_err());
        // A tab of the same name in another session is another tab.
        assert!(leases.need(&Tab { session: "t".into(), tab: "b".into() }).is_err());
        assert!(leases.holds(&tab("b")) && !leases.holds(&tab("a")));
        // Idle for longer than a minute.
        leases.0.lock().unwrap().as_mut().unwrap().used -= IDLE;
        assert!(!leases.holds(&tab("b")));
        assert!(leases.need(&tab("b")).is_err() && leases.state().holder.is_none());
        leases.take(&tab("a"), false).unwrap();
    }
}
