//! In: the types. Out: the one vision system as nodes: its state machines, recipes, results, and what the station
//! shows; names of the variables whose values change.
//! Frame and unit: poses in mm and degrees in the station's notation; standard deviations in mm and degrees.

use super::ids::{METHODS, kind, state};
use super::types::insert_method;
use opcua::server::address_space::{
    AddressSpace, EventNotifier, MethodBuilder, ObjectBuilder, ReferenceDirection, VariableBuilder,
};
use opcua::types::{
    Argument, DataTypeId, LocalizedText, NodeId, ObjectId, ObjectTypeId, QualifiedName, ReferenceTypeId,
    VariableTypeId, Variant,
};

/// Numbers of the namespaces on this server.
#[derive(Clone, Copy, Debug)]
pub struct Spaces {
    pub vision: u16,
    pub own: u16,
}

/// The vision system's name.
pub const SYSTEM: &str = "VisionSystem";
const OUTER: &str = "VisionSystem.VisionStateMachine";
const INNER: &str = "VisionSystem.VisionStateMachine.AutomaticModeStateMachine";
const RECIPES: &str = "VisionSystem.RecipeManagement";
const RESULTS: &str = "VisionSystem.ResultManagement";
const STATION: &str = "VisionSystem.Station";
const LAST: &str = "VisionSystem.LastResult";

/// A variable or an argument: name, type, array.
type Row = (&'static str, DataTypeId, bool);

/// A method of ours: name, inputs, outputs.
type Guided = (&'static str, &'static [Row], &'static [Row]);

/// What the station shows.
const SHOWN: [Row; 19] = [
    ("Connected", DataTypeId::Boolean, false),
    ("Trouble", DataTypeId::String, false),
    ("RunsJobs", DataTypeId::Boolean, false),
    ("RobotLinked", DataTypeId::Boolean, false),
    ("RobotArmed", DataTypeId::Boolean, false),
    ("ScreenOperates", DataTypeId::Boolean, false),
    ("RobotMoves", DataTypeId::Boolean, false),
    ("SomebodyMustLook", DataTypeId::Boolean, false),
    ("JobNumber", DataTypeId::UInt32, false),
    ("JobState", DataTypeId::String, false),
    ("Phase", DataTypeId::String, false),
    ("AwaitsConfirmation", DataTypeId::String, false),
    ("JobsEnded", DataTypeId::UInt16, false),
    ("Inserted", DataTypeId::UInt16, false),
    ("PreparedRecipe", DataTypeId::String, false),
    ("LastRefusal", DataTypeId::Int32, false),
    ("LastRefusalWords", DataTypeId::String, false),
    ("Shots", DataTypeId::UInt16, false),
    ("Recipes", DataTypeId::String, true),
];

/// The last result, for clients that read no structures.
const RESULT: [Row; 15] = [
    ("ResultId", DataTypeId::String, false),
    ("ResultState", DataTypeId::Int32, false),
    ("Recipe", DataTypeId::String, false),
    ("PartId", DataTypeId::String, false),
    ("Found", DataTypeId::Int32, false),
    ("Pose", DataTypeId::Double, true),
    ("Approach", DataTypeId::Double, true),
    ("Retract", DataTypeId::Double, true),
    ("SigmaMm", DataTypeId::Double, true),
    ("SigmaDeg", DataTypeId::Double, true),
    ("GatesJudged", DataTypeId::String, true),
    ("GatesPassed", DataTypeId::String, true),
    ("Score", DataTypeId::Double, false),
    ("Error", DataTypeId::Int32, false),
    ("ErrorWords", DataTypeId::String, false),
];

/// Methods for a station whose robot the client moves.
const GUIDED: [Guided; 2] = [
    (
        "AddPose",
        &[("Flange", DataTypeId::Double, true)],
        &[("Shots", DataTypeId::UInt32, false), ("Error", DataTypeId::Int32, false)],
    ),
    ("FindPart", &[], &[("Error", DataTypeId::Int32, false)]),
];

impl Spaces {
    /// A node of the vision system.
    pub fn own(&self, name: &str) -> NodeId {
        NodeId::new(self.own, name)
    }

    /// The vision system itself.
    pub fn system(&self) -> NodeId {
        self.own(SYSTEM)
    }

    /// A variable of what the station shows.
    pub fn shown(&self, name: &str) -> NodeId {
        self.own(&format!("{STATION}.{name}"))
    }

    /// A variable of the last result.
    pub fn result(&self, name: &str) -> NodeId {
        self.own(&format!("{LAST}.{name}"))
    }

    /// A variable of a state machine, of the outer one or of the automatic mode's.
    pub fn machine(&self, outer: bool, name: &str) -> NodeId {
        self.own(&format!("{}.{name}", if outer { OUTER } else { INNER }))
    }

    /// A state machine.
    pub fn machine_itself(&self, outer: bool) -> NodeId {
        self.own(if outer { OUTER } else { INNER })
    }

    /// The name of a method by its node.
    pub fn method<'a>(&self, id: &'a NodeId) -> Option<&'a str> {
        let opcua::types::Identifier::String(name) = &id.identifier else { return None };
        (id.namespace == self.own).then(|| name.as_ref().rsplit('.').next()).flatten()
    }

    fn object(&self, space: &mut AddressSpace, id: &str, name: QualifiedName, kind: NodeId, parent: NodeId) {
        let shown = LocalizedText::from(name.name.as_ref());
        ObjectBuilder::new(&self.own(id), name, shown).component_of(parent).has_type_definition(kind).insert(space);
    }

    fn variable(&self, space: &mut AddressSpace, parent: &str, (name, data_type, array): Row) {
        let id = self.own(&format!("{parent}.{name}"));
        let builder = VariableBuilder::new(&id, QualifiedName::new(self.own, name), name)
            .component_of(self.own(parent))
            .has_type_definition(VariableTypeId::BaseDataVariableType)
            .data_type(data_type)
            .value_rank(if array { 1 } else { -1 });
        builder.value(Variant::Empty).insert(space);
    }

    /// Inserts the vision system below the objects.
    pub fn insert(&self, space: &mut AddressSpace) {
        let vision = |name: &str| QualifiedName::new(self.vision, name);
        let kind_of = |id: u32| NodeId::new(self.vision, id);
        ObjectBuilder::new(&self.system(), QualifiedName::new(self.own, SYSTEM), SYSTEM)
            .organized_by(ObjectId::ObjectsFolder)
            .has_type_definition(kind_of(kind::VISION_SYSTEM))
            .event_notifier(EventNotifier::SUBSCRIBE_TO_EVENTS)
            .insert(space);
        // Its events are those of the server object too.
        space.insert_reference(&ObjectId::Server.into(), &self.system(), ReferenceTypeId::HasNotifier);
        let outer = kind_of(kind::VISION_STATE_MACHINE);
        self.object(space, OUTER, vision("VisionStateMachine"), outer, self.system());
        let inner = kind_of(kind::AUTOMATIC_STATE_MACHINE);
        self.object(space, INNER, vision("AutomaticModeStateMachine"), inner, self.own(OUTER));
        space.insert_reference(
            &NodeId::new(self.vision, state::OPERATIONAL),
            &self.own(INNER),
            ReferenceTypeId::HasSubStateMachine,
        );
        self.object(space, RECIPES, vision("RecipeManagement"), kind_of(kind::RECIPE_MANAGEMENT), self.system());
        self.object(space, RESULTS, vision("ResultManagement"), kind_of(kind::RESULT_MANAGEMENT), self.system());
        for (id, name) in [(STATION, "Station"), (LAST, "LastResult")] {
            let name = QualifiedName::new(self.own, name);
            self.object(space, id, name, ObjectTypeId::BaseObjectType.into(), self.system());
        }
        for machine in [OUTER, INNER] {
            self.states(space, machine);
        }
        for method in &METHODS {
            let parent = match method.owner {
                kind::VISION_STATE_MACHINE => OUTER,
                kind::AUTOMATIC_STATE_MACHINE => INNER,
                kind::RECIPE_MANAGEMENT => RECIPES,
                _ => RESULTS,
            };
            let id = format!("{parent}.{}", method.name);
            let ids = [id.clone(), format!("{id}.InputArguments"), format!("{id}.OutputArguments")];
            insert_method(space, self.vision, method, ids.map(|id| self.own(&id)), &self.own(parent), false);
        }
        for shown in SHOWN {
            self.variable(space, STATION, shown);
        }
        for result in RESULT {
            self.variable(space, LAST, result);
        }
        for (name, takes, gives) in GUIDED {
            self.guided(space, name, takes, gives);
        }
    }

    /// Current state and last transition of a machine.
    fn states(&self, space: &mut AddressSpace, machine: &str) {
        let core = |name: &str| QualifiedName::new(0, name);
        let rows = [
            ("CurrentState", VariableTypeId::FiniteStateVariableType),
            ("LastTransition", VariableTypeId::FiniteTransitionVariableType),
        ];
        for (name, kind) in rows {
            let id = self.own(&format!("{machine}.{name}"));
            VariableBuilder::new(&id, core(name), name)
                .component_of(self.own(machine))
                .has_type_definition(kind)
                .data_type(DataTypeId::LocalizedText)
                .value(LocalizedText::null())
                .insert(space);
            for (property, data_type) in [("Id", DataTypeId::NodeId), ("Number", DataTypeId::UInt32)] {
                VariableBuilder::new(&self.own(&format!("{machine}.{name}.{property}")), core(property), property)
                    .property_of(id.clone())
                    .has_type_definition(VariableTypeId::PropertyType)
                    .data_type(data_type)
                    .value(Variant::Empty)
                    .insert(space);
            }
        }
    }

    fn guided(&self, space: &mut AddressSpace, name: &str, takes: &[Row], gives: &[Row]) {
        let id = format!("{STATION}.{name}");
        let one = |(name, data_type, array): &Row| Argument {
            name: (*name).into(),
            data_type: (*data_type).into(),
            value_rank: if *array { 1 } else { -1 },
            array_dimensions: array.then(|| vec![6]),
            description: LocalizedText::null(),
        };
        let mut builder = MethodBuilder::new(&self.own(&id), QualifiedName::new(self.own, name), name)
            .reference(self.own(STATION), ReferenceTypeId::HasComponent, ReferenceDirection::Inverse)
            .executable(true)
            .user_executable(true);
        if !takes.is_empty() {
            let takes: Vec<Argument> = takes.iter().map(one).collect();
            builder = builder.input_args(space, &self.own(&format!("{id}.InputArguments")), &takes);
        }
        let gives: Vec<Argument> = gives.iter().map(one).collect();
        builder.output_args(space, &self.own(&format!("{id}.OutputArguments")), &gives).insert(space);
    }
}
