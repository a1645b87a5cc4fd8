//! In: a motion that a page shows, a button that is held. Out: a grant for that motion, which can be redeemed once.
//! Frame and unit: seconds; motions are identified by their hash.

use crate::web::guard::{Tab, random_hex};
use crate::web::message::Confirmed;
use sheetlight::fault::{Fault, Result};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Shortest time that the button must be held before anything moves.
pub const HELD: Duration = Duration::from_millis(800);
/// Time after which an unused grant expires.
pub const LONGEST: Duration = Duration::from_secs(5);

struct Grant {
    name: String,
    tab: Tab,
    what: Confirmed,
    given: Instant,
}

/// The unused grant: one at a time, because one tab operates.
#[derive(Default)]
pub struct Grants(Mutex<Option<Grant>>);

impl Grants {
    /// The button is pressed: makes a new grant and cancels every earlier one.
    pub fn give(&self, tab: &Tab, what: Confirmed) -> String {
        let name = random_hex();
        let grant = Grant { name: name.clone(), tab: tab.clone(), what, given: Instant::now() };
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = Some(grant);
        name
    }

    /// The button was held: redeems the grant. Returns an error if no grant has this name, if it belongs to another
    /// tab or motion, was not held long enough, or is too old.
    pub fn redeem(&self, name: &str, tab: &Tab, what: &Confirmed) -> Result<()> {
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let no = |why: String| {
            Err(Fault::refused(why).cause("nothing was moved").next("look at the pose and hold the button again"))
        };
        let Some(grant) = held.take() else { return no("this confirmation is not known, or was used already".into()) };
        if grant.name != name {
            return no("this confirmation is not known, or was used already".into());
        }
        if grant.tab != *tab {
            return no("the button was held on another screen".into());
        }
        if grant.what != *what {
            return no("the pose is not the one that was shown when the button was pressed".into());
        }
        let age = grant.given.elapsed();
        if age < HELD || age > LONGEST {
            return no(format!(
                "the button was held for {:.1} s, {:.1} to {:.0} are wanted",
                age.as_secs_f64(),
                HELD.as_secs_f64(),
                LONGEST.as_secs_f64()
            ));
        }
        Ok(())
    }

    /// A tab releases the button: its grant is cancelled.
    pub fn drop_of(&self, tab: &Tab) {
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if held.as_ref().is_some_and(|g| g.tab == *tab) {
            *held = None;
        }
    }

    /// Cancels the grant of any tab.
    pub fn drop_all(&self) {
        *self.0.lock().unwrap_or_else(|e| e.into_inner()) = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_is_for_one_pose_one_tab_and_one_time() {
        let tab = |t: &str| Tab { session: "s".into(), tab: t.into() };
        let what = |hash: &str| Confirmed { job: "0001-insert".into(), hash: hash.into() };
        let grants = Grants::default();
        let held = |ms: u64| {
            let name = grants.give(&tab("a"), what("x"));
            grants.0.lock().unwrap().as_mut().unwrap().given -= Duration::from_millis(ms);
            name
        };
        let ok = held(900);
        grants.redeem(&ok, &tab("a"), &what("x")).unwrap();
        assert!(grants.redeem(&ok, &tab("a"), &what("x")).unwrap_err().what.contains("used already"));
        assert!(grants.redeem(&held(900), &tab("b"), &what("x")).unwrap_err().what.contains("another screen"));
        assert!(grants.redeem(&held(900), &tab("a"), &what("y")).unwrap_err().what.contains("not the one"));
        assert!(grants.redeem(&held(100), &tab("a"), &what("x")).unwrap_err().what.contains("held for 0.1 s"));
        assert!(grants.redeem(&held(9000), &tab("a"), &what("x")).is_err());
        let former = held(900);
        let newer = held(900);
        assert!(grants.redeem(&former, &tab("a"), &what("x")).is_err(), "a newer press takes the former's place");
        assert!(grants.redeem(&newer, &tab("a"), &what("x")).is_err(), "and a wrong try ends it");
        let name = held(900);
        grants.drop_all();
        assert!(grants.redeem(&name, &tab("a"), &what("x")).is_err());
    }
}
