//! `render --audit`: its output, and the independence of the picture and of resumed renders from it.

use crate::support::Folder;

#[test]
fn an_audit_says_what_it_knows() {
    let folder = Folder::new("audit");
    let render = "render scene.obj --size 48x48 --spp 32 --reconstruct off --json";
    let plain = folder.object(&format!("{render} -o a.pfm"));
    assert!(plain["error"]["bias"].is_null() && plain["error"]["noise"].is_null());
    let audited = folder.object(&format!("{render} -o b.pfm --audit 10% --report r"));
    assert_eq!(std::fs::read(folder.path("a.pfm")).unwrap(), std::fs::read(folder.path("b.pfm")).unwrap());

    let (error, bias) = (&audited["error"], &audited["error"]["bias"]);
    assert_eq!(error["noise"]["relmse"], plain["error"]["relmse"]);
    assert_eq!(bias["audit"]["pixels"], 256);
    assert!(bias["audit"]["samples"].as_u64() >= Some(4) && bias["audit"]["seconds"].as_f64() > Some(0.0));
    assert_eq!(bias["regions"].as_array().unwrap().len(), 16);
    assert!(bias["detectable"].as_f64() > Some(0.0) && bias["found"].is_boolean());
    let detectable = bias["detectable"].as_f64().unwrap();
    let [bias, noise] = [bias, &error["noise"]].map(|part| part["relmse"].as_f64().unwrap());
    // An uncertain bias counts for less (docs/decisions/error-estimate.md).
    let sure = if bias > 0.0 { (bias - detectable * detectable / (4.0 * bias)).max(0.0) } else { 0.0 };
    assert!((error["relmse"].as_f64().unwrap() - noise - sure).abs() < 1e-12, "{bias} {detectable}");
    assert_eq!(folder.page_object("r"), audited);
    let text = folder.run("render scene.obj -o c.pfm --size 16x16 --spp 16 --audit 0.2");
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.contains("noise and bias") && text.contains("audit  "), "{text}");
    assert!(folder.refused("render scene.obj --audit 90%").contains("a share up to a half"));
}

#[test]
fn an_audit_goes_on_where_it_was() {
    let folder = Folder::new("audit-resumed");
    let common = "render scene.obj --size 48x48 --audit 10% --seed 3 --json";
    let stop = "--error 0.002 --spp 4000";
    let whole = folder.object(&format!("{common} {stop} -o whole.pfm"));
    folder.object(&format!("{common} --error 0.002 --spp 64 -o part.pfm --checkpoint part.film"));
    let resumed = folder.object(&format!("{common} {stop} -o resumed.pfm --resume part.film"));
    let pictures = ["whole.pfm", "resumed.pfm"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert!(pictures[0] == pictures[1], "{} {}", whole["spp"], resumed["spp"]);
    for key in ["relmse", "interval", "noise"] {
        assert_eq!(whole["error"][key], resumed["error"][key], "{key}");
    }
    assert_eq!(whole["error"]["bias"]["regions"], resumed["error"]["bias"]["regions"]);
}
