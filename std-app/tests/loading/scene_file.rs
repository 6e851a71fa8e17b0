//! Errors of scene files.

use crate::support::Folder;
use halflight::load::scene_file::parse;
use std::fs;
use std::path::Path;

fn error(text: &str) -> String {
    parse(text, Path::new("a.toml")).unwrap_err().to_string()
}

#[test]
fn errors_have_line_and_column() {
    let check = |text: &str, line: u32, problem: &str| {
        let error = error(text);
        assert!(error.starts_with(&format!("a.toml:{line}:")) && error.contains(problem), "{error}");
    };
    check(
        "[camera]\neyes = [0, 0, 0]\n",
        2,
        "unknown field `eyes`\n  help: expected one of `kind`, `eye`, `look_at`",
    );
    check("\n  [render\n", 2, "");
    check("[camera]\neye = [0, 0]\nlook_at = [0, 0, 1]", 2, "");
    check("[camera]\neye = [0, 0, nan]\nlook_at = [0, 0, 1]", 2, "must be finite");
    check("[camera]\neye = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 180", 4, "less than 178 degrees");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = \"big\"", 3, "a number or three numbers");
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = ";
    check(&format!("{light}-9"), 4, "-9.0 is negative");
    check(&format!("{light}[1, 2, 1e38]"), 4, "1e38 is too large: light and colours are at most 1e15");
    check(&format!("{light}[1, 2]"), 4, "three numbers");
    check(&format!("{light}nan"), 4, "finite");
    check("[environment]\nradiance = 1e30", 2, "at most 1e15");
    check("[environment]\nradiance = [0, -1e-9, 0]", 2, "negative");
    check("[material.a]\nemission = inf", 2, "too large");
    check("[material.a]\ncolor = -0.5", 2, "no reflectance");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = 1e31", 3, "from 1e-30 to 1e30");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = [1, 1, nan]", 3, "from 1e-30 to 1e30");
    check("[camera]\neye = [0, 0, 0]\nlook_at = [0, 0, 1]\nlens_radius = -1", 4, "from 0 to 1e30");
    check("[render]\nspp = -1", 2, "");
    check("[[light]]\nkind = \"laser\"", 2, "`point`, `spot`");
    check("[[mesh]]\nfile = \"a.obj\"\nmatrix = [[1, 0, 0, 0]]", 3, "three or four rows");
}

#[test]
fn senseless_settings_are_refused_where_they_are() {
    for setting in [
        "size = [0, 5]",
        "size = [2000000, 1]",
        "size = [30000, 30000]",
        "size = [16]",
        "spp = 0",
        "spp = 2000000000",
        "spp = 1.5",
        "time = 0",
        "time = -1",
        "time = nan",
        "time = inf",
        "error = 0",
        "error = -1",
        "error = nan",
        "error = inf",
        "max_depth = 0",
        "max_depth = -1",
        "seed = -1",
        "seed = 4294967296",
        "method = \"photons\"",
    ] {
        let error = error(&format!("\n[render]\n{setting}"));
        let column = setting.find('=').unwrap() + 3;
        assert!(
            error.starts_with(&format!("a.toml:3:{column}: ")) || error.starts_with("a.toml:3:9: "),
            "{error}"
        );
    }
    let sensible = "[render]\nsize = [16, 9]\nspp = 1\ntime = 1e-3\nerror = 1e-9\nmax_depth = 1\n\
        seed = 4294967295\nmethod = \"Auto\"";
    assert!(parse(sensible, Path::new("a.toml")).is_ok());
}

#[test]
fn numbers_that_would_hide_something_are_refused() {
    for (entry, problem) in [
        ("[[mesh]]\nfile = \"a.obj\"\nscale = 0", "a factor"),
        ("[[mesh]]\nfile = \"a.obj\"\nscale = [1, 0, 1]", "a factor"),
        ("[[mesh]]\nfile = \"a.obj\"\nmatrix = [[0,0,0,0],[0,0,0,0],[0,0,0,0]]", "flattens"),
        ("[[mesh]]\nfile = \"a.obj\"\nmatrix = [[1,0,0,0],[0,1,0,0],[1,1,0,0]]", "flattens"),
        ("[[light]]\nkind = \"spot\"\nouter_degrees = 0", "the angle of a cone"),
        ("[material.a]\nspecular = 2", "no reflectance"),
        ("[material.a]\ntint = [0, 0, nan]", "no reflectance"),
        ("[material.a]\nkind = \"glass\"\nior = 0", "an index of refraction"),
    ] {
        let (error, line) = (error(entry), entry.matches('\n').count() + 1);
        assert!(error.starts_with(&format!("a.toml:{line}:")) && error.contains(problem), "{error}");
    }
    for key in ["roughness", "metallic", "opacity"] {
        for value in ["-0.1", "1.1", "nan", "inf"] {
            let error = error(&format!("[material.a]\n{key} = {value}"));
            assert!(error.starts_with("a.toml:2:") && error.contains("between 0 and 1"), "{error}");
        }
    }
}

#[test]
fn keys_of_other_kinds_are_refused_at_the_light() {
    let folder = Folder::new("light-keys");
    for (keys, message) in [
        ("kind = \"point\"\nposition = [0, 1, 0]\nirradiance = 3", "a point light has no `irradiance`"),
        ("kind = \"directional\"\ndirection = [0, -1, 0]\nintensity = 3", "has no `intensity`"),
        ("kind = \"spot\"\nposition = [0, 1, 0]\nirradiance = 3", "a spot light has no `irradiance`"),
    ] {
        let text = format!("[[mesh]]\nfile = \"scene.obj\"\n[[light]]\n{keys}\n");
        fs::write(folder.path("a.toml"), text).unwrap();
        let said = folder.refused("info a.toml");
        assert!(said.contains(message) && said.contains("a.toml:3"), "{keys}: {said}");
    }
}
