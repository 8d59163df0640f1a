//! Every key of a deployment file, in order.

use crate::fields::fields_of;
use crate::schema::{Key, Shapes, schema};
use crate::{Deployment, Runtime, Supervision, capture, hosts, network, paper, person, results};

/// Name of a section, and its keys in order.
type Section = (&'static str, fn() -> &'static [&'static str]);

const SECTIONS: [Section; 8] = [
    ("capture", fields_of::<capture::Config>),
    ("person", fields_of::<person::Config>),
    ("network", fields_of::<network::Config>),
    ("paper", fields_of::<paper::Config>),
    ("results", fields_of::<results::Config>),
    ("link", fields_of::<hosts::Link>),
    ("supervise", fields_of::<Supervision>),
    ("runtime", fields_of::<Runtime>),
];

/// Returns every key of a deployment file, in the order of the structs that read it. A `[[camera]]` is one key.
pub fn keys() -> Vec<Key> {
    let schema = Shapes(schema());
    let top = fields_of::<Deployment>().iter();
    let mut keys = Vec::new();
    for name in top {
        match SECTIONS.iter().find(|section| section.0 == *name) {
            Some((section, fields)) => keys.extend(
                fields().iter().map(|name| schema.key(&format!("{section}."), section, name)),
            ),
            None => keys.push(schema.key("", "", name)),
        }
    }
    keys
}

/// Returns the keys of a `[[camera]]`, without their section.
pub(crate) fn camera_keys() -> Vec<Key> {
    let schema = Shapes(schema());
    let fields = fields_of::<capture::Camera>().iter();
    fields.map(|field| schema.key("", "camera", field)).collect()
}

/// Returns the keys of a `[[host]]`, without their section.
pub(crate) fn host_keys() -> Vec<Key> {
    let schema = Shapes(schema());
    let fields = fields_of::<hosts::Host>().iter();
    fields.map(|field| schema.key("", "host", field)).collect()
}

#[cfg(test)]
mod tests {
    use toml::{Table, Value};

    use super::*;
    use crate::Loaded;

    #[test]
    fn every_key_that_has_a_value_is_listed_and_every_key_is_explained() {
        let keys = keys();
        let defaults = Loaded::defaults(&[]).unwrap().deployment;
        for (section, value) in &Table::try_from(defaults).unwrap() {
            let names: Vec<String> = match value {
                Value::Table(inner) => inner.keys().map(|key| format!("{section}.{key}")).collect(),
                _ => vec![section.clone()],
            };
            for name in names {
                assert!(
                    keys.iter().any(|key| key.name == name),
                    "{name} is not listed"
                );
            }
        }
        for it in keys.into_iter().chain(camera_keys()).chain(host_keys()) {
            let is_sentence = it.meaning.ends_with('.') && !it.meaning.contains(". ");
            assert!(is_sentence && it.meaning.len() > 10, "{it:?}");
            assert!(!it.takes.is_empty() && !it.takes.contains("null"), "{it:?}");
        }
    }

    #[test]
    fn the_number_of_settings_is_limited() {
        let n = keys().len() + camera_keys().len() + host_keys().len();
        assert!(n <= 85, "{n} keys: which can go?");
    }

    #[test]
    fn a_camera_can_have_keypoints_in_place_of_footage() {
        let names: Vec<String> =
            camera_keys().into_iter().map(|camera_key| camera_key.name).collect();
        assert_eq!(
            names[..4],
            ["name", "source", "keypoints", "keypoint_names"]
        );
        let required = &schema()["$defs"]["Camera"]["required"];
        assert_eq!(*required, serde_json::json!(["name"]));
        let keys = camera_keys();
        for set in keypoints::files::NameSet::known_sets() {
            assert!(keys[3].meaning.contains(set), "{set}: {}", keys[3].meaning);
        }
    }

    #[test]
    fn keys_are_listed_in_the_order_of_their_sections() {
        let names: Vec<String> = keys().into_iter().map(|key| key.name).collect();
        assert_eq!(names[..3], ["name", "rig", "unit"]);
        assert_eq!(names.last().unwrap(), "runtime.lock_memory");
        let sections: Vec<&str> =
            names.iter().filter_map(|name| Some(name.split_once('.')?.0)).collect();
        let mut unique = sections.clone();
        unique.dedup();
        assert_eq!(unique, SECTIONS.map(|section| section.0));
        assert!(
            !names.iter().any(|name| name.starts_with("record")),
            "{names:?}"
        );
    }
}
