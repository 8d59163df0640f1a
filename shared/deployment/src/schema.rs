//! The JSON schema of deployment files, for editors and other programs.

use schemars::generate::SchemaSettings;
use serde_json::Value;

use crate::Deployment;
use crate::ranges::RANGES;

/// Returns the JSON schema (draft 2020-12) of a deployment file, generated from the structs that read it.
pub fn schema() -> Value {
    let generator = SchemaSettings::draft2020_12().into_generator();
    let mut schema = generator.into_root_schema_for::<Deployment>();
    schema.insert("title".to_owned(), "Parallax deployment".into());
    let mut schema = schema.to_value();
    for (key, least, most) in RANGES {
        if let Some(numbers) = numbers_of(&schema, key) {
            for number in numbers {
                if let Some(Value::Object(number)) = schema.pointer_mut(&number) {
                    number.insert("minimum".to_owned(), as_written(least));
                    number.insert("maximum".to_owned(), as_written(most));
                }
            }
        }
    }
    schema
}

/// Returns JSON pointers to the numbers of a key in the schema.
fn numbers_of(schema: &Value, key: &str) -> Option<Vec<String>> {
    let mut at = String::new();
    for name in key.split('.') {
        at = resolved(schema, at)?;
        if schema.pointer(&at)?["items"].is_object() {
            at = resolved(schema, format!("{at}/items"))?;
        }
        at = format!("{at}/properties/{name}");
    }
    let mut found = Vec::new();
    let mut waiting = vec![at];
    while let Some(at) = waiting.pop() {
        let at = resolved(schema, at)?;
        let node = schema.pointer(&at)?;
        for choice in ["anyOf", "oneOf"] {
            let n = node[choice].as_array().map_or(0, Vec::len);
            waiting.extend((0..n).map(|index| format!("{at}/{choice}/{index}")));
        }
        for inner in ["items", "additionalProperties"] {
            let is_one = node[inner].is_object();
            waiting.extend(is_one.then(|| format!("{at}/{inner}")));
        }
        let kinds = [&node["type"]];
        let mut kinds = kinds.into_iter().chain(node["type"].as_array().into_iter().flatten());
        if kinds.any(|kind| kind == "integer" || kind == "number") {
            found.push(at);
        }
    }
    Some(found)
}

/// Returns a pointer to the target of a reference; any other pointer is returned unchanged.
fn resolved(schema: &Value, at: String) -> Option<String> {
    let reference = schema.pointer(&at)?["$ref"].as_str();
    Some(reference.map_or(at, |reference| reference.trim_start_matches('#').to_owned()))
}

/// Converts a number; a whole number gets no decimal point.
fn as_written(number: f64) -> Value {
    if number.fract() == 0.0 {
        Value::from(number as i64)
    } else {
        Value::from(number)
    }
}

/// A key of a deployment file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// Name of the key with its section, such as `paper.workers`.
    pub name: String,
    /// Meaning of the key, from the documentation of its field.
    pub meaning: String,
    /// Accepted values, as TOML, such as `whole number` or `"paper" or "released"`.
    pub takes: String,
}

/// A JSON schema that returns the keys of its sections.
pub(crate) struct Shapes(pub Value);

impl Shapes {
    /// Returns one key of a section.
    ///
    /// * `prefix`: text to put before the name of the key.
    /// * `section`: section of the key; empty for top-level keys.
    pub(crate) fn key(&self, prefix: &str, section: &str, name: &str) -> Key {
        let of = if section.is_empty() {
            &self.0
        } else {
            let property = &self.0["properties"][section];
            let is_list = property.get("items").is_some();
            self.resolved(if is_list {
                &property["items"]
            } else {
                property
            })
        };
        let property = &of["properties"][name];
        let meaning = property["description"].as_str().unwrap_or_default();
        Key {
            name: format!("{prefix}{name}"),
            meaning: meaning.split_whitespace().collect::<Vec<_>>().join(" "),
            takes: self.takes(property),
        }
    }

    /// Follows a reference; returns any other schema unchanged.
    fn resolved<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let Some(reference) = schema["$ref"].as_str() else {
            return schema;
        };
        let name = reference.rsplit('/').next().unwrap_or_default();
        &self.0["$defs"][name]
    }

    /// Returns the values that a schema accepts, in words.
    fn takes(&self, schema: &Value) -> String {
        let schema = self.resolved(schema);
        for choice in ["anyOf", "oneOf"] {
            if let Some(choices) = schema[choice].as_array() {
                let all = choices.iter().filter(|choice| choice["type"] != "null");
                return all.map(|choice| self.takes(choice)).collect::<Vec<_>>().join(" or ");
            }
        }
        if let Some(values) = schema["enum"].as_array() {
            let values: Vec<String> = values.iter().map(Value::to_string).collect();
            return values.join(" or ");
        }
        if let Some(value) = schema.get("const") {
            return value.to_string();
        }
        let types = schema["type"].as_array();
        let kind = types.map_or(&schema["type"], |types| {
            let mut known = types.iter().filter(|kind| *kind != "null");
            known.next().unwrap_or(&Value::Null)
        });
        match kind.as_str().unwrap_or_default() {
            "integer" => "whole number".to_owned(),
            "number" => "number".to_owned(),
            "boolean" => "true or false".to_owned(),
            "string" => "text".to_owned(),
            "array" => self.list(schema),
            _ => "table".to_owned(),
        }
    }

    fn list(&self, schema: &Value) -> String {
        let item = self.takes(&schema["items"]);
        match schema["maxItems"].as_u64() {
            Some(n) => format!("list of {n}, each: {item}"),
            None => format!("list, each: {item}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_refuses_unknown_keys_and_requires_the_necessary_ones() {
        let schema = schema();
        assert_eq!(schema["additionalProperties"], false);
        let mut required: Vec<&str> = schema["required"]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(Value::as_str)
            .collect();
        required.sort_unstable();
        assert_eq!(required, ["camera", "name", "output", "rig"]);
    }

    /// Numbers that are bounded by their type or their meaning, not by a range.
    const WITHOUT_RANGE: [&str; 3] = ["up", "capture.frozen_after", "results.overlay_every"];

    #[test]
    fn every_number_has_the_range_that_the_rules_have() {
        let schema = schema();
        for (key, least, most) in RANGES.into_iter().filter(|range| range.0 != "camera") {
            let places = numbers_of(&schema, key).unwrap_or_default();
            assert!(!places.is_empty(), "{key} has no number");
            for place in places {
                let number = schema.pointer(&place).unwrap();
                let bounds = ["minimum", "maximum"].map(|name| number[name].as_f64());
                assert_eq!(bounds, [Some(least), Some(most)], "{place}");
            }
        }
        for key in crate::keys().iter().filter(|key| key.takes.contains("number")) {
            let has_range = RANGES.iter().any(|range| range.0 == key.name);
            let needs_none = WITHOUT_RANGE.contains(&key.name.as_str());
            assert!(has_range != needs_none, "{}: what may it be?", key.name);
        }
        assert_eq!(
            schema["$defs"]["Paper"]["properties"]["workers"]["maximum"],
            16
        );
    }

    #[test]
    fn the_ends_of_a_range_are_accepted_and_values_beyond_are_refused() {
        let read = |key: &str, value: f64| {
            let mut text = "name = 'two'\nrig = 'rig.toml'\noutput = 'out'\n\
                            [[camera]]\nname = 'a'\nsource = 'a.mp4'\n"
                .to_owned();
            let value = match key {
                "capture.size" => format!("[{value}, {value}]"),
                "paper.tau" => format!("[{value:?}]"),
                "runtime.cores" => format!("{{ pose = [{value}] }}"),
                "runtime.priority" => format!("{{ pose = {value} }}"),
                _ => value.to_string(),
            };
            let file = std::path::Path::new("deployment.toml");
            let set = match key.strip_prefix("camera.") {
                Some(of_camera) => {
                    text.extend([of_camera, " = ", &value, "\n"]);
                    Vec::new()
                }
                None => vec![format!("{key}={value}")],
            };
            let mut set = set;
            if key.starts_with("paper.") {
                set.push("method=paper".to_owned());
            }
            crate::Loaded::parse(&text, file, &set, &crate::AnyMachine)
        };
        for (key, least, most) in RANGES {
            if key == "camera" {
                continue; // the length of the list
            }
            for value in [least, most] {
                let said =
                    read(key, value).map_or_else(|error| error.to_string(), |_| String::new());
                assert_eq!(said, "", "{key} = {value}");
            }
            for value in [least - 1.0, most + 1.0] {
                assert!(read(key, value).is_err(), "{key} = {value} is taken");
            }
        }
    }

    #[test]
    fn the_accepted_values_of_a_key_are_described_in_words() {
        let keys = crate::keys();
        let takes = |name: &str| keys.iter().find(|key| key.name == name).unwrap().takes.clone();
        assert_eq!(takes("paper.workers"), "whole number");
        assert_eq!(takes("paper.energy"), "\"paper\" or \"released\"");
        assert_eq!(takes("paper.errors"), "text or table");
        assert_eq!(takes("capture.size"), "list of 2, each: whole number");
        assert_eq!(takes("up"), "list of 3, each: number");
        assert_eq!(takes("unit"), "text");
        assert_eq!(takes("rig"), "text");
    }
}
