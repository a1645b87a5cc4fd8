//! In: the table of numbers. Out: the types of OPC 40100-1 as nodes: object types with their states, transitions and
//! methods, events, data types with their definitions, so that a client that does not know the specification reads
//! the structures.

use super::ids::{Argument, METHODS, Method, Of, STATES, TRANSITIONS, data, kind};
use opcua::server::address_space::{
    AddressSpace, DataTypeBuilder, MethodBuilder, ObjectBuilder, ObjectTypeBuilder, ReferenceDirection, VariableBuilder,
};
use opcua::types::{
    Argument as Described, DataTypeId, EnumDefinition, EnumField, LocalizedText, NodeId, ObjectId, ObjectTypeId,
    QualifiedName, ReferenceTypeId, StructureDefinition, StructureField, StructureType, VariableTypeId,
};

/// A field: name, type, whether it is an array, whether it may be missing.
type Field = (&'static str, Of, bool, bool);

const BINARY_FIELDS: &[Field] = &[
    ("Id", Of::Vision(data::TRIMMED_STRING), false, false),
    ("Version", Of::Vision(data::TRIMMED_STRING), false, true),
    ("Hash", Of::Core(15), false, true),
    ("HashAlgorithm", Of::Core(12), false, true),
    ("Description", Of::Core(21), false, true),
];
const DESCRIBED_FIELDS: &[Field] =
    &[("Id", Of::Vision(data::TRIMMED_STRING), false, false), ("Description", Of::Core(21), false, true)];
const PLAIN_FIELDS: &[Field] = &[("Id", Of::Vision(data::TRIMMED_STRING), false, false)];
const TIMES_FIELDS: &[Field] = &[
    ("StartTime", Of::Core(294), false, false),
    ("EndTime", Of::Core(294), false, false),
    ("AcquisitionDuration", Of::Core(290), false, true),
    ("ProcessingDuration", Of::Core(290), false, true),
];
const RESULT_FIELDS: &[Field] = &[
    ("ResultId", Of::Vision(data::RESULT_ID), false, false),
    ("HasTransferableDataOnFile", Of::Core(1), false, true),
    ("IsPartial", Of::Core(1), false, false),
    ("IsSimulated", Of::Core(1), false, true),
    ("ResultState", Of::Vision(data::RESULT_STATE), false, false),
    ("MeasId", Of::Vision(data::MEAS_ID), false, true),
    ("PartId", Of::Vision(data::PART_ID), false, true),
    ("ExternalRecipeId", Of::Vision(data::RECIPE_ID_EXTERNAL), false, true),
    ("InternalRecipeId", Of::Vision(data::RECIPE_ID_INTERNAL), false, false),
    ("ProductId", Of::Vision(data::PRODUCT_ID), false, true),
    ("ExternalConfigurationId", Of::Vision(data::CONFIGURATION_ID), false, true),
    ("InternalConfigurationId", Of::Vision(data::CONFIGURATION_ID), false, false),
    ("JobId", Of::Vision(data::JOB_ID), false, false),
    ("CreationTime", Of::Core(294), false, false),
    ("ProcessingTimes", Of::Vision(data::PROCESSING_TIMES), false, true),
    ("ResultContent", Of::Core(24), true, true),
];

/// Structures: number, name, what they are a subtype of, number of the binary encoding, all fields.
const STRUCTURES: [(u32, &str, Of, u32, &[Field]); 11] = [
    (data::BINARY_ID, "BinaryIdBaseDataType", Of::Core(22), 5027, BINARY_FIELDS),
    (data::RECIPE_ID_EXTERNAL, "RecipeIdExternalDataType", Of::Vision(data::BINARY_ID), 5002, BINARY_FIELDS),
    (data::RECIPE_ID_INTERNAL, "RecipeIdInternalDataType", Of::Vision(data::BINARY_ID), 5268, BINARY_FIELDS),
    (data::CONFIGURATION_ID, "ConfigurationIdDataType", Of::Vision(data::BINARY_ID), 5090, BINARY_FIELDS),
    (data::MEAS_ID, "MeasIdDataType", Of::Core(22), 5006, DESCRIBED_FIELDS),
    (data::PART_ID, "PartIdDataType", Of::Core(22), 5013, DESCRIBED_FIELDS),
    (data::PRODUCT_ID, "ProductIdDataType", Of::Core(22), 5224, DESCRIBED_FIELDS),
    (data::JOB_ID, "JobIdDataType", Of::Core(22), 5008, PLAIN_FIELDS),
    (data::RESULT_ID, "ResultIdDataType", Of::Core(22), 5274, PLAIN_FIELDS),
    (data::PROCESSING_TIMES, "ProcessingTimesDataType", Of::Core(22), 5016, TIMES_FIELDS),
    (data::RESULT, "ResultDataType", Of::Core(22), 5018, RESULT_FIELDS),
];

/// Data types that are another name of a simple one.
const SIMPLE: [(u32, &str, u32); 3] = [
    (data::RESULT_STATE, "ResultStateDataType", 6),
    (data::TRIMMED_STRING, "TrimmedString", 12),
    (data::HANDLE, "Handle", 7),
];

/// Object types without children of their own here: number, name, type above.
const OBJECT_TYPES: [(u32, &str, ObjectTypeId); 10] = [
    (kind::VISION_SYSTEM, "VisionSystemType", ObjectTypeId::BaseObjectType),
    (kind::RECIPE_MANAGEMENT, "RecipeManagementType", ObjectTypeId::BaseObjectType),
    (kind::RESULT_MANAGEMENT, "ResultManagementType", ObjectTypeId::BaseObjectType),
    (kind::VISION_STATE_MACHINE, "VisionStateMachineType", ObjectTypeId::FiniteStateMachineType),
    (kind::AUTOMATIC_STATE_MACHINE, "VisionAutomaticModeStateMachineType", ObjectTypeId::FiniteStateMachineType),
    (kind::JOB_STARTED, "JobStartedEventType", ObjectTypeId::BaseEventType),
    (kind::STATE_CHANGED, "StateChangedEventType", ObjectTypeId::TransitionEventType),
    (kind::RECIPE_PREPARED, "RecipePreparedEventType", ObjectTypeId::BaseEventType),
    (kind::READY, "ReadyEventType", ObjectTypeId::BaseEventType),
    (kind::RESULT_READY, "ResultReadyEventType", ObjectTypeId::BaseEventType),
];

/// Properties of the events: type, number, name, data type, whether mandatory.
const EVENT_FIELDS: [(u32, u32, &str, Of, bool); 12] = [
    (kind::JOB_STARTED, 6141, "JobId", Of::Vision(data::JOB_ID), true),
    (kind::READY, 6294, "JobId", Of::Vision(data::JOB_ID), true),
    (kind::RECIPE_PREPARED, 6291, "ExternalId", Of::Vision(data::RECIPE_ID_EXTERNAL), false),
    (kind::RECIPE_PREPARED, 6140, "InternalId", Of::Vision(data::RECIPE_ID_INTERNAL), true),
    (kind::RESULT_READY, 6295, "ResultId", Of::Vision(data::RESULT_ID), true),
    (kind::RESULT_READY, 6300, "JobId", Of::Vision(data::JOB_ID), true),
    (kind::RESULT_READY, 6298, "ResultState", Of::Vision(data::RESULT_STATE), true),
    (kind::RESULT_READY, 6296, "IsPartial", Of::Core(1), true),
    (kind::RESULT_READY, 6302, "InternalRecipeId", Of::Vision(data::RECIPE_ID_INTERNAL), true),
    (kind::RESULT_READY, 6142, "InternalConfigurationId", Of::Vision(data::CONFIGURATION_ID), true),
    (kind::RESULT_READY, 6303, "CreationTime", Of::Core(294), true),
    (kind::RESULT_READY, 6306, "ResultContent", Of::Core(24), false),
];

/// The node of a type.
pub fn node(of: Of, vision: u16) -> NodeId {
    match of {
        Of::Core(id) => NodeId::new(0, id),
        Of::Vision(id) => NodeId::new(vision, id),
    }
}

fn rule(mandatory: bool) -> ObjectId {
    if mandatory { ObjectId::ModellingRule_Mandatory } else { ObjectId::ModellingRule_Optional }
}

/// The arguments as a client reads them.
pub fn described(arguments: &[Argument], vision: u16) -> Vec<Described> {
    let one = |(name, of, array): &Argument| Described {
        name: (*name).into(),
        data_type: node(*of, vision),
        value_rank: if *array { 1 } else { -1 },
        array_dimensions: array.then(|| vec![0]),
        description: LocalizedText::null(),
    };
    arguments.iter().map(one).collect()
}

/// Inserts a method with its arguments below an object.
pub fn insert_method(
    space: &mut AddressSpace,
    vision: u16,
    method: &Method,
    [id, inputs, outputs]: [NodeId; 3],
    parent: &NodeId,
    in_type: bool,
) {
    let mut builder = MethodBuilder::new(&id, QualifiedName::new(vision, method.name), method.name)
        .component_of(parent.clone())
        .executable(true)
        .user_executable(true);
    if in_type {
        builder =
            builder.reference(rule(method.mandatory), ReferenceTypeId::HasModellingRule, ReferenceDirection::Forward);
    }
    if !method.takes.is_empty() {
        builder = builder.input_args(space, &inputs, &described(method.takes, vision));
    }
    builder.output_args(space, &outputs, &described(method.gives, vision)).insert(space);
}

/// Inserts all types.
pub fn insert(space: &mut AddressSpace, vision: u16) {
    let of = |id: u32| NodeId::new(vision, id);
    let named = |name: &str| QualifiedName::new(vision, name);
    for (id, name, above) in OBJECT_TYPES {
        ObjectTypeBuilder::new(&of(id), named(name), name).subtype_of(above).insert(space);
    }
    for (owner, id, name, data_type, mandatory) in EVENT_FIELDS {
        let array = name == "ResultContent";
        VariableBuilder::new(&of(id), named(name), name)
            .property_of(of(owner))
            .has_type_definition(VariableTypeId::PropertyType)
            .has_modelling_rule(rule(mandatory))
            .data_type(node(data_type, vision))
            .value_rank(if array { 1 } else { -1 })
            .insert(space);
    }
    machines(space, vision);
    for method in &METHODS {
        let ids = [of(method.id), of(method.inputs_id), of(method.outputs_id)];
        insert_method(space, vision, method, ids, &of(method.owner), true);
    }
    data_types(space, vision);
}

/// States and transitions.
fn machines(space: &mut AddressSpace, vision: u16) {
    let of = |id: u32| NodeId::new(vision, id);
    let machine = |outer: bool| of(if outer { kind::VISION_STATE_MACHINE } else { kind::AUTOMATIC_STATE_MACHINE });
    let mut insert = |id: u32, outer: bool, name: &str, number: u32, number_id: u32, state: bool| {
        let (kind, property) = match state {
            true => (ObjectTypeId::StateType, "StateNumber"),
            false => (ObjectTypeId::TransitionType, "TransitionNumber"),
        };
        ObjectBuilder::new(&of(id), QualifiedName::new(vision, name), name)
            .component_of(machine(outer))
            .has_type_definition(kind)
            .insert(space);
        VariableBuilder::new(&of(number_id), property, property)
            .property_of(of(id))
            .has_type_definition(VariableTypeId::PropertyType)
            .data_type(DataTypeId::UInt32)
            .value(number)
            .insert(space);
    };
    for s in &STATES {
        insert(s.id, s.vision, s.name, s.number, s.number_id, true);
    }
    for t in &TRANSITIONS {
        insert(t.id, t.vision, t.name, t.number, t.number_id, false);
    }
    for t in &TRANSITIONS {
        space.insert_reference(&of(t.id), &of(t.from), ReferenceTypeId::FromState);
        space.insert_reference(&of(t.id), &of(t.to), ReferenceTypeId::ToState);
        // Causes that are not served have no node.
        if METHODS.iter().any(|m| m.id == t.cause) {
            space.insert_reference(&of(t.id), &of(t.cause), ReferenceTypeId::HasCause);
        }
        space.insert_reference(&of(t.id), &of(kind::STATE_CHANGED), ReferenceTypeId::HasEffect);
    }
}

fn data_types(space: &mut AddressSpace, vision: u16) {
    let of = |id: u32| NodeId::new(vision, id);
    for (id, name, above) in SIMPLE {
        DataTypeBuilder::new(&of(id), QualifiedName::new(vision, name), name)
            .subtype_of(NodeId::new(0, above))
            .insert(space);
    }
    let values = [("FALSE_0", 0), ("TRUE_1", 1), ("DONTCARE_2", 2)];
    let field = |(name, value): (&str, i64)| EnumField { name: name.into(), value, ..EnumField::default() };
    DataTypeBuilder::new(
        &of(data::TRI_STATE),
        QualifiedName::new(vision, "TriStateBooleanDataType"),
        "TriStateBooleanDataType",
    )
    .subtype_of(DataTypeId::Enumeration)
    .data_type_definition(EnumDefinition { fields: Some(values.map(field).to_vec()) }.into())
    .insert(space);
    for (id, name, above, encoding, fields) in STRUCTURES {
        let field = |(name, of, array, optional): &Field| StructureField {
            name: (*name).into(),
            data_type: node(*of, vision),
            value_rank: if *array { 1 } else { -1 },
            array_dimensions: array.then(|| vec![0]),
            is_optional: *optional,
            ..StructureField::default()
        };
        let optional = fields.iter().any(|f| f.3);
        let definition = StructureDefinition {
            default_encoding_id: of(encoding),
            base_data_type: node(above, vision),
            structure_type: if optional {
                StructureType::StructureWithOptionalFields
            } else {
                StructureType::Structure
            },
            fields: Some(fields.iter().map(field).collect()),
        };
        DataTypeBuilder::new(&of(id), QualifiedName::new(vision, name), name)
            .is_abstract(id == data::BINARY_ID)
            .subtype_of(node(above, vision))
            .data_type_definition(definition.into())
            .insert(space);
        ObjectBuilder::new(&of(encoding), "Default Binary", "Default Binary")
            .has_type_definition(ObjectTypeId::DataTypeEncodingType)
            .reference(of(id), ReferenceTypeId::HasEncoding, ReferenceDirection::Inverse)
            .insert(space);
    }
}
