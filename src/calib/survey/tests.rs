use super::*;

fn error<T: std::fmt::Debug>(result: Result<T>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn points_are_read_as_programs_write_them() {
    let plain = "a1,0,0,0\na2,10.5,0,0\na3,0,-3e1,0\n17,5,5,2.25\n";
    let read = points(plain, "p.csv").unwrap();
    assert_eq!(read.names(), ["a1", "a2", "a3", "17"]);
    assert_eq!(read.points()[1], Point3::new(10.5, 0.0, 0.0));
    for same in [
        "\u{feff}# surveyed in May\nid;x;y;z\r\na1;0;0;0\r\na2;10,5;0;0\r\n\r\na3;0;-30;0\r\n17;5;5;2,25\r\n",
        "Z, Y, X, ID\n0,0,0,a1\n0,0,10.5,a2\n0,-30,0,a3\n# the top\n2.25,5,5,17\n",
        "a1 0 0 0\n  a2   10.5 0 0\na3 0 -30 0\n17 5\t5 2.25\n",
        "point\teast\tnorth\tup\na1\t0\t0\t0\na2\t10.5\t0\t0\na3\t0\t-30\t0\n17\t5\t5\t2.25\tnote\n",
        "\"a1\",0,0,0\n\"a2\",\"10.5\",0,0\na3,0,-30,0\n17,5,5,2.25",
    ] {
        assert_eq!(points(same, "p.csv").unwrap(), read, "{same}");
    }
}

#[test]
fn bad_points_say_file_line_and_remedy() {
    let good = "a,0,0,0\nb,1,0,0\nc,0,1,0\n";
    for (bad, says) in [
        ("d,1,x,0\n", "p.csv: line 4: y is \"x\", a number was expected"),
        ("d,1,NaN,0\n", "line 4: y is \"NaN\""),
        ("d,1,inf,0\n", "line 4: y is \"inf\""),
        ("d,1,2\n", "line 4: 3 fields, 4 are needed: id,x,y,z"),
        ("\n# here\nb,1,2,0\n", "line 6: the point b is in line 2 already: remove one of them"),
        ("", "3 points: at least 4 are needed"),
    ] {
        let text = error(points(&format!("{good}{bad}"), "p.csv"));
        assert!(text.contains(says), "{text}");
    }
    assert!(error(points("# nothing\n", "p.csv")).contains("it is empty: lines of id,x,y,z are expected"));
    assert!(error(points("a,0,0,0\nb,1,1,0\nc,2,2,0\nd,3,3,0\n", "p.csv")).contains("on a line"));
}

#[test]
fn observations_belong_to_points_and_pictures() {
    let target = points("a,0,0,0\nb,1,0,0\nc,0,1,0\nd,0,1,5\n", "p.csv").unwrap();
    let text = "image,id,u,v,sigma\nx.jpg,c,10.25,20,0.1\ny.jpg,d,5,6,0.2\nx.jpg,a,1,2,0.3\n";
    let read = Observations::from_csv(text, "o.csv", Some(&target)).unwrap();
    let corner = |index, x, y, sigma_px| Corner { index, px: Vector2::new(x, y), sigma_px };
    assert_eq!(read.frames.iter().map(|f| &f.file[..]).collect::<Vec<_>>(), ["x.jpg", "y.jpg"]);
    assert_eq!(read.frames[0].corners, [corner(0, 1.0, 2.0, 0.3), corner(2, 10.25, 20.0, 0.1)]);
    assert_eq!(read.inside(&[[640, 480], [640, 480]]), Ok(()));
    let outside = error(read.inside(&[[8, 8], [640, 480]]));
    assert!(outside.contains("o.csv: line 2: 10.2, 20.0 is outside a picture of 8 x 8 px"), "{outside}");
    for (bad, says) in [
        ("x.jpg,e,1,2\n", "line 2: the point e is not in the file of --target, which has a, b, c, …"),
        ("x.jpg,a,1,2\nx.jpg,a,3,4\n", "line 3: the point a of x.jpg is in line 2 already"),
        ("x.jpg,a,1,2,-1\n", "line 2: sigma must not be negative"),
        ("x.jpg,a,1,two\n", "line 2: v is \"two\""),
        ("", "there is no observation"),
    ] {
        let text =
            error(Observations::from_csv(&format!("image,id,u,v,sigma\n{bad}"), "o.csv", Some(&target)));
        assert!(text.contains(says), "{text}");
    }
    // Without a target they are corners of a board.
    let board = Observations::from_csv("x.jpg 53 10 20\n", "o.csv", None).unwrap();
    assert_eq!(board.frames[0].corners, [corner(53, 10.0, 20.0, 0.0)]);
    assert!(error(Observations::from_csv("x.jpg a 10 20\n", "o.csv", None)).contains("--target"));
}

#[test]
fn indices_may_be_names() {
    let target = points("12,0,0,0\n7,1,0,0\n3,0,1,0\n4,0,1,5\n", "p.csv").unwrap();
    let corner = |index| Corner { index, px: Vector2::new(1.0, 2.0), sigma_px: 0.0 };
    let mut corners = [corner(3), corner(7), corner(12)];
    by_name(&mut corners, &target, "c.json").unwrap();
    assert_eq!(corners.map(|c| c.index), [0, 1, 2]);
    assert!(error(by_name(&mut [corner(5)], &target, "c.json")).contains("point 5 is not among"));
}
