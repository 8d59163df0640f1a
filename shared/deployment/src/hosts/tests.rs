//! Tests of deployments with several hosts.

use std::path::Path;

use crate::{AnyMachine, Deployment, Loaded};

const GOOD: &str = "name = 'a'\nrig = 'r'\noutput = 'o'\n\
    [[camera]]\nname = 'c0'\nsource = 's'\n[[camera]]\nname = 'c1'\nsource = 's'\n\
    [capture]\nmode = 'realtime'\nframe_rate_hz = 5.0\n\
    [link]\nkeys = 'keys'\n\
    [[host]]\nname = 'desk'\nfuses = true\naddress = '10.0.0.1:7447'\nviews = ['c0']\n\
    [[host]]\nname = 'far'\nviews = ['c1']\n";

fn parse(text: &str) -> Result<Deployment, String> {
    let loaded = Loaded::parse(text, Path::new("/d/d.toml"), &[], &AnyMachine);
    loaded.map(|loaded| loaded.deployment).map_err(|error| error.to_string())
}

#[test]
fn views_belong_to_hosts_and_keys_lie_beside_the_file() {
    let it = parse(GOOD).unwrap();
    assert_eq!(it.fusing_host().unwrap().name, "desk");
    assert_eq!(it.views_of(&it.hosts[1]), [1]);
    assert_eq!(it.name_on(&it.hosts[1]), "a.far");
    assert_eq!(it.link.keys.as_deref(), Some(Path::new("/d/keys")));
}

#[test]
fn impossible_host_settings_are_refused_with_their_key() {
    for (from, to, key) in [
        ("name = 'far'", "name = 'desk'", "host.name"),
        ("name = 'far'", "name = 'Far'", "host.name"),
        (
            "name = 'far'",
            "name = 'a-name-that-is-much-too-long-for-it'",
            "host.name",
        ),
        ("views = ['c1']", "views = ['c9']", "host.views"),
        ("views = ['c1']", "views = []", "host.views"),
        ("views = ['c1']", "views = ['c0', 'c1']", "host.views"),
        ("fuses = true", "fuses = false", "host.fuses"),
        ("name = 'far'", "name = 'far'\nfuses = true", "host.fuses"),
        ("address = '10.0.0.1:7447'\n", "", "host.address"),
        ("10.0.0.1:7447", "10.0.0.1", "host.address"),
        ("10.0.0.1:7447", "10.0.0.1:0", "host.address"),
        ("10.0.0.1:7447", "10.0.0.1;x/y:80", "host.address"),
        ("mode = 'realtime'", "mode = 'lossless'", "capture.mode"),
        ("frame_rate_hz = 5.0\n", "", "capture.frame_rate_hz"),
        ("keys = 'keys'\n", "", "link.keys"),
        (
            "keys = 'keys'",
            "keys = 'keys'\ninsecure = true",
            "link.insecure",
        ),
        (
            "keys = 'keys'",
            "keys = 'keys'\njpeg_quality = 0",
            "link.jpeg_quality",
        ),
        (
            "keys = 'keys'",
            "keys = 'keys'\ncarry = 'poses'\n[paper]\nviews = 'all'",
            "link.carry",
        ),
    ] {
        let mut text = GOOD.replacen(from, to, 1);
        if to.contains("[paper]") {
            text = text.replacen("output = 'o'", "output = 'o'\nmethod = 'paper'", 1);
        }
        assert_ne!(text, GOOD, "{from}");
        let error = parse(&text).unwrap_err();
        assert!(
            error.contains(&format!("`{key}`")),
            "{from} -> {to}: {error}"
        );
    }
    let one = GOOD.split("[[host]]\nname = 'far'").next().unwrap();
    assert!(parse(one).unwrap_err().contains("`host` is given once"));
}

#[test]
fn a_deployment_without_hosts_has_no_host_settings() {
    let text = GOOD.split("[link]").next().unwrap();
    let it = parse(text).unwrap();
    assert!(it.hosts.is_empty() && it.fusing_host().is_none());
    assert!(!toml::to_string(&it).unwrap().contains("[[host]]"));
}
