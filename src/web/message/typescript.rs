//! In: the messages' types. Out: their TypeScript declarations, which the pages' editors and tests use.
//! Frame and unit: none.

use super::*;
use ts_rs::TS;

/// Content of `docs/messages.d.ts`; a test compares the file with this.
pub fn declarations() -> String {
    let all = [
        of_bar(),
        of_orders(),
        of_outcomes(),
        of_motion(),
        of_door(),
        of_station(),
        of_recipes(),
        of_surface(),
        of_sweep(),
    ]
    .concat();
    let body: Vec<String> = all.iter().map(|d| format!("export {d}")).collect();
    format!(
        "// Made from src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.\n\n{}\n",
        body.join("\n\n")
    )
}

/// The bar, job states and faults.
fn of_bar() -> Vec<String> {
    vec![
        Mode::decl(),
        RobotState::decl(),
        Frames::decl(),
        CalibrationAge::decl(),
        Lease::decl(),
        Bar::decl(),
        JobState::decl(),
        Problem::decl(),
    ]
}

/// Orders.
fn of_orders() -> Vec<String> {
    vec![
        Target::decl(),
        TeachOrder::decl(),
        Plain::decl(),
        ScanOrder::decl(),
        Filter::decl(),
        Filters::decl(),
        Filtered::decl(),
        FilterOrder::decl(),
        FindOrder::decl(),
        TouchOrder::decl(),
        CalibrateOrder::decl(),
        JointOrder::decl(),
        AutoOrder::decl(),
        InsertOrder::decl(),
        BenchmarkOrder::decl(),
        Order::decl(),
    ]
}

/// Results of orders, and the camera's state in them.
fn of_outcomes() -> Vec<String> {
    vec![
        CheckLine::decl(),
        ScanFigures::decl(),
        Notation::decl(),
        RobotPoses::decl(),
        Term::decl(),
        GateLight::decl(),
        Position::decl(),
        SurfaceTouched::decl(),
        SquareProposed::decl(),
        Touched::decl(),
        CalibrationFigures::decl(),
        Inserted::decl(),
        StripeSeen::decl(),
        PictureLook::decl(),
        ExposureSet::decl(),
        CameraFeature::decl(),
        CameraState::decl(),
        SetFeature::decl(),
        BenchRow::decl(),
        KeptUp::decl(),
        Outcome::decl(),
        Job::decl(),
    ]
}

/// The robot's motions, and events for viewers.
fn of_motion() -> Vec<String> {
    vec![Asked::decl(), SimulatedCell::decl(), MotionState::decl(), Arming::decl(), InTheCell::decl(), Event::decl()]
}

/// Sessions, the lease and confirmations.
fn of_door() -> Vec<String> {
    vec![Knock::decl(), Session::decl(), TakeLease::decl(), Confirmed::decl(), Grant::decl(), Redeem::decl()]
}

/// The station: calibrations, settings, recordings.
fn of_station() -> Vec<String> {
    vec![
        CalibrationState::decl(),
        FrameInfo::decl(),
        StationInfo::decl(),
        BackupInfo::decl(),
        Connection::decl(),
        SettingsState::decl(),
        SettingsAsk::decl(),
        OutputAsk::decl(),
        RecordingInfo::decl(),
        BoardView::decl(),
        ViewRef::decl(),
        SupportAsk::decl(),
        PictureRef::decl(),
    ]
}

/// Recipes and their drawings.
fn of_recipes() -> Vec<String> {
    vec![
        RecipeText::decl(),
        RecipeAsk::decl(),
        PointsOf::decl(),
        RecipePoint::decl(),
        NewPoint::decl(),
        PointChange::decl(),
        PointsChange::decl(),
        PointsChanged::decl(),
        DrawingAsk::decl(),
        DrawingRead::decl(),
    ]
}

/// Viewing a scan and measuring in it.
fn of_surface() -> Vec<String> {
    vec![
        MapHead::decl(),
        Outlines::decl(),
        Ghost::decl(),
        SectionAsk::decl(),
        SectionPoint::decl(),
        Distance::decl(),
        Fit::decl(),
        Section::decl(),
        PointsAsk::decl(),
        PlaneAsk::decl(),
        Measure::decl(),
        MeasureAnswer::decl(),
    ]
}

/// Planned sweeps, and repeatability.
fn of_sweep() -> Vec<String> {
    vec![SweepAsk::decl(), Pace::decl(), SweepPlan::decl(), RepeatsAsk::decl(), Spread::decl(), Repeats::decl()]
}
