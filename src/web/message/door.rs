//! In: nothing. Out: how a session is opened, who operates, and how a motion is confirmed.
//! Frame and unit: poses by their hash.

use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// Opens a session: one of the two.
#[derive(Deserialize, TS)]
#[serde(deny_unknown_fields, default)]
#[derive(Default)]
pub struct Knock {
    /// Of this start of the program.
    pub token: Option<String>,
    /// Where the screen is served to other machines.
    pub password: Option<String>,
}

/// A session.
#[derive(Serialize, TS)]
pub struct Session {
    /// A short name of the tab that asks.
    pub tab: String,
}

/// Operate from this tab.
#[derive(Default, Deserialize, TS)]
#[serde(deny_unknown_fields, default)]
pub struct TakeLease {
    /// Also where another one operates.
    pub firmly: bool,
}

/// What a person confirms by holding the button.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct Confirmed {
    /// The job that asks.
    pub job: String,
    /// `hash` of the motion that was shown.
    pub hash: String,
}

/// The right to one motion.
#[derive(Serialize, TS)]
pub struct Grant {
    /// The name under which it is redeemed, once.
    pub grant: String,
}

/// The button was held.
#[derive(Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct Redeem {
    /// What pressing it gave.
    pub grant: String,
    /// What is confirmed, again.
    pub what: Confirmed,
}
