//! What finds people where a deployment does not say: the network that ships, or the filters.

use std::path::PathBuf;

use crate::complaint::Complaint;
use crate::fuse::{Energy, Views};
use crate::pose::Search;
use crate::triangulate::Combine;
use crate::{Deployment, SHIPPED, is_shipped};

/// Lets the network that ships find people, unless the deployment names a network, keypoints, or a model of filters.
///
/// # Errors
///
/// A setting that only the filters have, where nothing says that they find people.
pub(crate) fn settle(it: &mut Deployment, given: &toml::Table) -> Result<(), Complaint> {
    let says_network = given
        .get("pose")
        .is_some_and(|it| it.get("network").is_some());
    if says_network || it.has_maps() || it.model.is_some() {
        return Ok(());
    }
    if let Some(key) = key_of_filters(it) {
        return Err(Complaint {
            key: key.to_owned(),
            got: value(given, key),
            expected:
                "to be left out, since it is of the filters and a network finds people here; or \
                       `network = \"none\"` in [pose], which lets the filters find them"
                    .to_owned(),
        });
    }
    it.pose.network = Some(PathBuf::from(SHIPPED));
    Ok(())
}

/// A key that says something of the filters alone, or of the paper's energy, which their poses are made for.
fn key_of_filters(it: &Deployment) -> Option<&'static str> {
    let fuse = &it.fuse;
    let keys = [
        (fuse.energy != Energy::Paper, "fuse.energy"),
        (!fuse.pairs.is_empty(), "fuse.pairs"),
        (fuse.workers > 1, "fuse.workers"),
        (
            it.triangulate.combine != Combine::Mean,
            "triangulate.combine",
        ),
        (
            matches!(fuse.views, Some(Views::Pairs | Views::All)),
            "fuse.views",
        ),
        (it.has_quality(), "quality"),
        (fuse.consistency.is_some(), "fuse.consistency"),
        (!fuse.compatibility.is_empty(), "fuse.compatibility"),
        (it.pose.search != Search::Full, "pose.search"),
        (!is_shipped(&it.pose.orientation), "pose.orientation"),
        (
            !is_shipped(&it.triangulate.joint_map),
            "triangulate.joint_map",
        ),
    ];
    keys.into_iter().find(|it| it.0).map(|it| it.1)
}

/// The value of a dotted key, as text.
fn value(given: &toml::Table, key: &str) -> String {
    let mut keys = key.split('.');
    let first = keys.next().and_then(|key| given.get(key));
    let found = keys.fold(first, |table, key| table?.get(key));
    found.map_or_else(String::new, ToString::to_string)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::{AnyMachine, ConfigError, Deployment, Loaded};

    const HEAD: &str = "name = 'n'\nrig = 'r'\noutput = 'o'\n";
    const CAMERAS: &str =
        "[[camera]]\nname = 'a'\nsource = 'a.mp4'\n[[camera]]\nname = 'b'\nsource = 'b.mp4'\n";

    fn read(more: &str) -> Result<Loaded, ConfigError> {
        let text = format!("{HEAD}{CAMERAS}{more}");
        Loaded::parse(&text, Path::new("n.toml"), &[], &AnyMachine)
    }

    fn parsed(more: &str) -> Deployment {
        read(more).unwrap().deployment
    }

    #[test]
    fn the_network_that_ships_finds_people_where_nothing_is_said() {
        let network = parsed("").pose.network;
        assert_eq!(network.as_deref(), Some(Path::new("shipped")));
        let also = parsed("[pose]\ncandidates = 4\n[capture]\nscale = 0.5\n");
        assert!(also.has_maps());
    }

    #[test]
    fn no_setting_of_the_filters_exchanges_the_network_for_them() {
        let settings = [
            "[pose]\nsearch = 'tracked'\n",
            "[pose]\norientation = 'none'\n",
            "[quality]\nnetwork = 'shipped'\n",
            "[fuse]\nviews = 'pairs'\n",
            "[fuse]\nworkers = 2\n",
            "[fuse]\nconsistency = 'shipped'\n",
            "[triangulate]\njoint_map = 'none'\n",
        ];
        for more in settings {
            let error = read(more).unwrap_err().to_string();
            assert!(error.contains("`network = \"none\"` in [pose]"), "{error}");
            let text = format!("{HEAD}model = 'person.fmp'\n{CAMERAS}{more}");
            let loaded = Loaded::parse(&text, Path::new("n.toml"), &[], &AnyMachine);
            assert!(!loaded.unwrap().deployment.has_maps(), "{more}");
        }
        assert!(!parsed("[pose]\nnetwork = 'none'\n[fuse]\nworkers = 2\n").has_maps());
    }
}
