//! In: nothing. Out: every route of the API in one table, which the server, the description and the tests read.
//! Frame and unit: none.

use super::{camera, jobs, metrics, motion, place, session, settings, support, surface, sweep};
use crate::web::screen::Screen;
use axum::routing::{MethodRouter, delete, get, post, put};
use std::sync::Arc;

/// Prefix of every path in the table.
pub const ROOT: &str = "/api/v1";

/// A route.
pub struct Route {
    /// GET, POST, PUT or DELETE.
    pub method: &'static str,
    /// Path below [`ROOT`].
    pub path: &'static str,
    /// What the route does, in one sentence.
    pub does: &'static str,
    /// Name of the message in the body; empty if there is none.
    pub takes: &'static str,
    /// Name of the message in the answer, followed by `[]` for a list; a media type if the answer is not JSON.
    pub gives: &'static str,
    /// True: only the tab that operates may call it.
    pub lease: bool,
    /// Status of the answer; of that without a body too, if there may be none.
    pub answers: &'static [u16],
    pub(super) handler: MethodRouter<Arc<Screen>>,
}

fn route(
    (method, path): (&'static str, &'static str),
    does: &'static str,
    (takes, gives): (&'static str, &'static str),
    handler: MethodRouter<Arc<Screen>>,
) -> Route {
    Route { method, path, does, takes, gives, lease: false, answers: &[200], handler }
}

impl Route {
    fn leased(self) -> Route {
        Route { lease: true, ..self }
    }

    fn answering(self, answers: &'static [u16]) -> Route {
        Route { answers, ..self }
    }
}

const BYTES: &str = "application/octet-stream";

/// All routes.
pub fn routes() -> Vec<Route> {
    let subjects = [
        of_door(),
        of_station(),
        of_pictures(),
        of_camera(),
        of_recipes(),
        of_jobs(),
        of_scans(),
        of_robot(),
        of_motion(),
    ];
    subjects.into_iter().flatten().collect()
}

/// Sessions, the lease, and the events for viewers.
fn of_door() -> Vec<Route> {
    vec![
        route(
            ("POST", "/session"),
            "Open a session with the token of this start, or with the password",
            ("Knock", ""),
            post(session::open),
        ),
        route(("GET", "/session"), "Whether there is a session", ("", "Session"), get(session::state)),
        route(
            ("POST", "/lease"),
            "Operate from this tab, or go on operating",
            ("TakeLease", "Lease"),
            post(session::take),
        ),
        route(("POST", "/lease/release"), "Let another tab operate", ("", "Lease"), post(session::release)).leased(),
        route(
            ("GET", "/events"),
            "WebSocket: the state, then events, and rows of the growing height map",
            ("", "Event"),
            get(session::events),
        ),
    ]
}

/// The station: settings, backups, boards, and the support file.
fn of_station() -> Vec<Route> {
    vec![
        route(("GET", "/station"), "Settings and calibrations", ("", "StationInfo"), get(place::station)),
        route(("GET", "/settings"), "Settings and backups", ("", "SettingsState"), get(settings::state)),
        route(
            ("PUT", "/settings"),
            "Change settings; the previous ones are backed up",
            ("SettingsAsk", "SettingsState"),
            put(settings::change),
        )
        .leased(),
        route(("POST", "/backups"), "Back the station up", ("", "SettingsState"), post(settings::back_up)).leased(),
        route(
            ("GET", "/backups/{name}"),
            "A backup to keep elsewhere",
            ("", "application/json"),
            get(settings::backup),
        ),
        route(
            ("POST", "/backups/{name}/restore"),
            "Put the station into the state of a backup",
            ("", "SettingsState"),
            post(settings::restore),
        )
        .leased(),
        route(("GET", "/bar"), "What the bar shows", ("", "Bar"), get(place::bar)),
        route(
            ("GET", "/metrics"),
            "What the bar shows, as Prometheus reads it",
            ("", "text/plain"),
            get(metrics::metrics),
        ),
        route(("GET", "/boards"), "Names of the station's calibration boards", ("", ""), get(place::boards)),
        route(
            ("GET", "/support"),
            "Settings, jobs and machine for somebody who helps; pictures=true: the newest ones too",
            ("?SupportAsk", "application/json"),
            get(support::support),
        ),
    ]
}

/// Recordings and their pictures.
fn of_pictures() -> Vec<Route> {
    vec![
        route(
            ("GET", "/recordings"),
            "Recordings below the recordings' folder",
            ("", "RecordingInfo[]"),
            get(place::recordings),
        ),
        route(("GET", "/picture"), "A picture of a recording", ("?PictureRef", "image/png"), get(place::picture)),
        route(
            ("GET", "/view"),
            "The board in a picture of a recording: its corners, how it leans",
            ("?ViewRef", "BoardView"),
            get(place::view),
        ),
        route(
            ("GET", "/look"),
            "What a picture of a recording shows: levels, and the stripe along its length",
            ("?PictureRef", "PictureLook"),
            get(camera::look_back),
        ),
    ]
}

/// The running camera.
fn of_camera() -> Vec<Route> {
    vec![
        route(("GET", "/camera"), "What the camera can be set to", ("", "CameraState"), get(camera::state)),
        route(
            ("PUT", "/camera/features"),
            "Set the camera; what was set from here is set again where it forgets it",
            ("SetFeature", "CameraState"),
            put(camera::set),
        )
        .leased(),
        route(
            ("GET", "/camera/look"),
            "What the camera's newest picture shows: levels, and the stripe along its length",
            ("", "PictureLook"),
            get(camera::look_now),
        ),
        route(
            ("GET", "/camera/newest"),
            "The camera's newest picture other than the one of number after=, with its peaks; 204: none yet",
            ("", BYTES),
            get(camera::newest),
        )
        .answering(&[200, 204]),
    ]
}

/// Recipes, and the planned sweep of the line over a part.
fn of_recipes() -> Vec<Route> {
    vec![
        route(
            ("GET", "/recipes"),
            "Recipes, shipped ones and the station's",
            ("", "RecipeText[]"),
            get(place::recipes),
        ),
        route(
            ("PUT", "/recipes/{name}"),
            "Check and store a recipe; an own one of that name is backed up and replaced only with replace",
            ("RecipeAsk", "RecipeText"),
            put(place::save_recipe),
        )
        .leased(),
        route(
            ("DELETE", "/recipes/{name}"),
            "Take a recipe of the station away; it is backed up",
            ("", ""),
            delete(place::remove_recipe),
        )
        .leased(),
        route(
            ("POST", "/points"),
            "Shapes and constructed points of a recipe's text, where the drawing has them",
            ("PointsOf", "RecipePoint[]"),
            post(place::points),
        ),
        route(
            ("POST", "/points/change"),
            "A recipe's text with a constructed point more or less, or with another that the tool goes to",
            ("PointsChange", "PointsChanged"),
            post(place::change_points),
        ),
        route(
            ("POST", "/drawings"),
            "Make a recipe of a drawing (DXF) and store it",
            ("DrawingAsk", "DrawingRead"),
            post(place::drawing),
        )
        .leased(),
        route(
            ("GET", "/sweep"),
            "How the line would go over a recipe's part, and which speed, step and pictures a second go together",
            ("?SweepAsk", "SweepPlan"),
            get(sweep::planned),
        ),
    ]
}

/// Jobs and their files.
fn of_jobs() -> Vec<Route> {
    vec![
        route(("GET", "/jobs"), "Jobs, newest first", ("", "Job[]"), get(jobs::list)),
        route(("POST", "/jobs"), "Order a procedure", ("Order", "Job"), post(jobs::order)).leased().answering(&[202]),
        route(("GET", "/jobs/{id}"), "One job", ("", "Job"), get(jobs::get)),
        route(("DELETE", "/jobs/{id}"), "Take a job and its files away", ("", ""), delete(jobs::remove)).leased(),
        route(
            ("POST", "/jobs/{id}/{what}"),
            "stop, resume, back_out or accept a job; stop needs no lease",
            ("", "Job"),
            post(jobs::act),
        )
        .leased(),
        route(
            ("GET", "/jobs/{id}/views"),
            "Newest pictures of a calibration by the robot, with the corners that were found",
            ("", "BoardView[]"),
            get(jobs::views),
        ),
        route(
            ("GET", "/jobs/{id}/outlines"),
            "Outlines of the part that a job found, in three dimensions",
            ("", "Outlines"),
            get(camera::outlines),
        ),
        route(
            ("GET", "/jobs/{id}/ghost"),
            "The same over the camera's picture of number=",
            ("", "Ghost"),
            get(camera::ghost),
        ),
        route(("GET", "/jobs/{id}/files/{*name}"), "A file that a job left", ("", BYTES), get(jobs::file)),
        route(
            ("POST", "/repeats"),
            "How the places of one part repeat that jobs have found",
            ("RepeatsAsk", "Repeats"),
            post(sweep::repeated),
        ),
    ]
}

/// Viewing a scan and measuring in it.
fn of_scans() -> Vec<Route> {
    vec![
        route(
            ("GET", "/scans/{id}/map"),
            "What the numbers of a scan's height map mean",
            ("", "MapHead"),
            get(surface::head),
        ),
        route(
            ("GET", "/scans/{id}/filters"),
            "Filters through which a scan is looked at",
            ("", "Filtered"),
            get(surface::filters),
        ),
        route(
            ("PUT", "/scans/{id}/filters"),
            "Look at a scan through these filters; fewer of them undo",
            ("Filters", "Filtered"),
            put(surface::filter),
        )
        .leased(),
        route(
            ("GET", "/scans/{id}/map/{layer}"),
            "height, sigma or intensity of each cell",
            ("", BYTES),
            get(surface::layer),
        ),
        route(
            ("POST", "/scans/{id}/section"),
            "Heights along a line, and lines through pieces of it",
            ("SectionAsk", "Section"),
            post(surface::along),
        ),
        route(
            ("POST", "/scans/{id}/measure"),
            "Between two places, or from a plane",
            ("Measure", "MeasureAnswer"),
            post(surface::measured),
        ),
        route(("GET", "/scans/{id}/points"), "Points to look at (most=)", ("", BYTES), get(surface::points)),
    ]
}

/// The robot, real or simulated: its state and who may move it.
fn of_robot() -> Vec<Route> {
    vec![
        route(("GET", "/motion"), "The robot as it may be moved from here", ("", "MotionState"), get(motion::state)),
        route(
            ("POST", "/robot"),
            "Arm the robot from this tab, or give it back",
            ("Arming", "MotionState"),
            post(motion::arm),
        )
        .leased(),
        route(
            ("POST", "/robot/output"),
            "Try an output of the controller: a laser or lamp for a moment, the gripper",
            ("OutputAsk", ""),
            post(settings::output),
        )
        .leased(),
        route(
            ("POST", "/robot/looked"),
            "Somebody has looked at the robot after a motion that was stopped",
            ("", "MotionState"),
            post(motion::looked),
        )
        .leased(),
        route(
            ("POST", "/simulated"),
            "What a person does in the simulated cell: a component into the gripper, the arm jogged",
            ("InTheCell", "MotionState"),
            post(motion::simulated),
        )
        .leased(),
    ]
}

/// One motion, from the pressed button to the halt.
fn of_motion() -> Vec<Route> {
    vec![
        route(
            ("POST", "/motion/press"),
            "The button over a motion goes down",
            ("Confirmed", "Grant"),
            post(motion::press),
        )
        .leased(),
        route(
            ("POST", "/motion/go"),
            "It was held: make that motion, once; say 'held GRANT' over the WebSocket while it is held on",
            ("Redeem", ""),
            post(motion::go),
        )
        .leased(),
        route(("POST", "/motion/refuse"), "No: the job that asks ends", ("Confirmed", ""), post(motion::refuse))
            .leased(),
        route(
            ("POST", "/motion/release"),
            "The button was let go: what moves is halted",
            ("", ""),
            post(motion::release),
        ),
        route(("POST", "/stop"), "STOP: what moves is halted, every job ends", ("", ""), post(motion::stop)),
    ]
}
