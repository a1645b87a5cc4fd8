//! In: nothing. Out: how a session is opened, which tab operates, and how a motion is confirmed.
//! Frame and unit: motions by their hash.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// Opens a session by one of these two.
#[derive(Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[derive(Default)]
pub struct Knock {
    /// The token of this program start.
    pub token: Option<String>,
    /// The password, if the screen is served to other machines.
    pub password: Option<String>,
}

/// A session.
#[derive(Serialize, TS, JsonSchema)]
pub struct Session {
    /// A short name of the tab that sent the request.
    pub tab: String,
}

/// Takes the lease for this tab.
#[derive(Default, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TakeLease {
    /// Takes it even if another tab operates.
    pub firmly: bool,
}

/// What a person confirms by holding the button.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Confirmed {
    /// The job that proposes the motion.
    pub job: String,
    /// `hash` of the motion that was shown.
    pub hash: String,
}

/// A confirmation of one motion.
#[derive(Serialize, TS, JsonSchema)]
pub struct Grant {
    /// The name under which the confirmation is redeemed once.
    pub grant: String,
}

/// The button was held.
#[derive(Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Redeem {
    /// The grant that pressing the button returned.
    pub grant: String,
    /// The confirmed motion again.
    pub what: Confirmed,
}
