// A ball on a flat: the lower cap of a ball, cut square, and a block. Structured hexahedra, finest at the contact.
//
// Lengths in mm; x and y from the middle, z up from the contact. The ball touches the flat in one point.
// With flat_radius both are crossed cylinders, whose contact is an ellipse, of equal radii a circle: the ball is one
// along y, the flat one along x.
// Physical groups: every name starts with the body it belongs to, punch_ (the ball) or strip_ (the flat).

DefineConstant[
  radius = 5,
  contact_width = 0.4,    // side of the square in which the surfaces may touch
  ball_margin = 0.6,      // by which the ball goes on beyond it on each side
  ball_height = 0.8,
  flat_radius = 0,        // of crossed cylinders: that of the one along x; 0: a ball on a flat
  flat_length = 4,        // along x
  flat_width = 4,         // along y
  flat_height = 1.6,
  stroke = 0.1,           // by which the square is longer along x on the flat, on each side
  across = 8,             // elements over the square, without those of its core
  core = 0,               // side of a square in its middle, where the contact begins, with elements of its own; 0: none
  core_elements = 0,      // over the core
  stroke_elements = 2,    // over the stroke on each side of it
  margin_elements = 2,    // over each margin
  ball_layers = 4,        // elements over the height
  flat_layers = 5,
  growth = 2,             // of an element's height over that of its neighbour towards the contact
  diffusion_length = 0    // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(radius <= 0 || contact_width <= 0 || ball_margin <= 0 || ball_height <= 0 || flat_height <= 0 || stroke < 0)
  Error("lengths must be positive");
EndIf
If(flat_radius < 0 || (flat_radius > 0 && flat_width / 2 >= 0.7 * flat_radius))
  Error("flat_radius must be 0, or so large that flat_width / 2 is less than 0.7 of it");
EndIf
If(flat_radius > 0 && flat_radius - Sqrt(flat_radius^2 - flat_width^2 / 4) >= 0.8 * flat_height)
  Error("flat_height must be larger: the edges of the lower cylinder come too near to its bottom");
EndIf
If(contact_width / 2 + ball_margin >= 0.7 * radius)
  Error("contact_width / 2 + ball_margin must be less than 0.7 radius");
EndIf
crossed = flat_radius > 0;
If(radius - Sqrt(radius^2 - (crossed ? 1 : 2) * (contact_width / 2 + ball_margin)^2) >= 0.8 * ball_height)
  Error("ball_height must be larger: the cap's corners come too near to its top");
EndIf
If(flat_length <= contact_width + 2 * stroke || flat_width <= contact_width)
  Error("flat_length and flat_width must be larger than the square that the ball sweeps");
EndIf
If(core < 0 || core >= contact_width || (core > 0 && (core_elements < 1 || across % 2 != 0)))
  Error("core must be smaller than contact_width, with core_elements in it and half of across, which is even, on each side");
EndIf
If(across < 1 || stroke_elements < 1 || margin_elements < 1 || ball_layers < 1 || flat_layers < 1 || growth <= 0)
  Error("across, stroke_elements, margin_elements, ball_layers and flat_layers must be at least 1, growth positive");
EndIf

// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * contact_width);
whole = 0;
For i In {0 : flat_layers - 1}
  whole += growth^i;
EndFor
top_growth = growth;
If(layer > 0 && flat_height / whole > layer)
  top_growth = (growth > 1.5) ? growth : 1.5;
  top_count = Ceil(Log(1 + (top_growth - 1) * flat_height / layer) / Log(top_growth));
  flat_layers = (top_count > flat_layers) ? top_count : flat_layers;
EndIf
growths[] = {growth, top_growth};

heights[] = {ball_height, -flat_height};
layers[] = {ball_layers, flat_layers};
h = contact_width / 2;
centre = newp; Point(centre) = {0, 0, radius};
// Lines within the square, and the elements between them.
inner[] = {}; n_inner[] = {across}; even[] = {1};
If(core > 0)
  inner[] = {-core / 2, core / 2};
  n_inner[] = {across / 2, core_elements, across / 2}; even[] = {1, 1, 1};
EndIf
For body In {0 : 1}
  // Lines of the grid along x and y, the elements between them and the ratio of their sizes.
  x[] = {}; y[] = {}; nx[] = {}; ny[] = {}; grade_x[] = {}; grade_y[] = {};
  If(body == 0)
    x[] = {-h - ball_margin, -h, inner[], h, h + ball_margin}; y[] = x[];
    nx[] = {margin_elements, n_inner[], margin_elements}; ny[] = nx[];
    grade_x[] = {1 / growth, even[], growth}; grade_y[] = grade_x[];
  Else
    If(stroke > 0)
      x[] = {-flat_length / 2, -h - stroke, -h, inner[], h, h + stroke, flat_length / 2};
      nx[] = {margin_elements, stroke_elements, n_inner[], stroke_elements, margin_elements};
      grade_x[] = {1 / growth, 1, even[], 1, growth};
    Else
      x[] = {-flat_length / 2, -h, inner[], h, flat_length / 2};
      nx[] = {margin_elements, n_inner[], margin_elements}; grade_x[] = {1 / growth, even[], growth};
    EndIf
    y[] = {-flat_width / 2, -h, inner[], h, flat_width / 2};
    ny[] = {margin_elements, n_inner[], margin_elements}; grade_y[] = {1 / growth, even[], growth};
  EndIf
  mx = #x[]; my = #y[];

  // Points, lines along x, y and z, faces and volumes by their place in the grid.
  p[] = {}; lx[] = {}; ly[] = {}; lz[] = {}; fx[] = {}; fy[] = {}; fz[] = {}; volumes~{body}[] = {};
  For k In {0 : 1}
    For j In {0 : my - 1}
      For i In {0 : mx - 1}
        n = newp; z = heights[body];
        If(k == 0 && body == 0)
          z = radius - Sqrt(radius^2 - x[i]^2 - (crossed ? 0 : y[j]^2));
        ElseIf(k == 0)
          z = crossed ? Sqrt(flat_radius^2 - y[j]^2) - flat_radius : 0;
        EndIf
        Point(n) = {x[i], y[j], z};
        p[] += n;
      EndFor
    EndFor
  EndFor
  For k In {0 : 1}
    For j In {0 : my - 1}
      For i In {0 : mx - 2}
        l = newl;
        If(body == 0 && k == 0)    // in the plane y = y_j a circle about the ball's centre line
          n = newp; Point(n) = {0, y[j], radius};
          Circle(l) = {p[i + mx * j], n, p[i + 1 + mx * j]};
        Else
          Line(l) = {p[i + mx * (j + my * k)], p[i + 1 + mx * (j + my * k)]};
        EndIf
        Transfinite Curve{l} = nx[i] + 1 Using Progression grade_x[i];
        lx[] += l;
      EndFor
    EndFor
    For j In {0 : my - 2}
      For i In {0 : mx - 1}
        l = newl;
        If(k == 0 && body == crossed)
          n = newp; Point(n) = {x[i], 0, crossed ? -flat_radius : radius};
          Circle(l) = {p[i + mx * j], n, p[i + mx * (j + 1)]};
        Else
          Line(l) = {p[i + mx * (j + my * k)], p[i + mx * (j + 1 + my * k)]};
        EndIf
        Transfinite Curve{l} = ny[j] + 1 Using Progression grade_y[j];
        ly[] += l;
      EndFor
    EndFor
  EndFor
  For j In {0 : my - 1}
    For i In {0 : mx - 1}
      l = newl; Line(l) = {p[i + mx * j], p[i + mx * (j + my)]};
      Transfinite Curve{l} = layers[body] + 1 Using Progression growths[body];
      lz[] += l;
    EndFor
  EndFor
  For k In {0 : 1}
    For j In {0 : my - 2}
      For i In {0 : mx - 2}
        a = lx[i + (mx - 1) * (j + my * k)]; b = ly[i + 1 + mx * (j + (my - 1) * k)];
        c = lx[i + (mx - 1) * (j + 1 + my * k)]; d = ly[i + mx * (j + (my - 1) * k)];
        n = newll; Curve Loop(n) = {a, b, -c, -d};
        s = news;
        If(body == 0 && k == 0)
          If(crossed)
            Surface(s) = {n};
          Else
            Surface(s) = {n} In Sphere {centre};
          EndIf
        ElseIf(k == 0 && crossed)
          Surface(s) = {n};
        Else
          Plane Surface(s) = {n};
        EndIf
        fz[] += s;
      EndFor
    EndFor
  EndFor
  For j In {0 : my - 1}
    For i In {0 : mx - 2}
      n = newll;
      Curve Loop(n) = {lx[i + (mx - 1) * j], lz[i + 1 + mx * j], -lx[i + (mx - 1) * (j + my)], -lz[i + mx * j]};
      s = news; Plane Surface(s) = {n};
      fy[] += s;
    EndFor
  EndFor
  For j In {0 : my - 2}
    For i In {0 : mx - 1}
      n = newll;
      Curve Loop(n) = {ly[i + mx * j], lz[i + mx * (j + 1)], -ly[i + mx * (j + my - 1)], -lz[i + mx * j]};
      s = news; Plane Surface(s) = {n};
      fx[] += s;
    EndFor
  EndFor
  For j In {0 : my - 2}
    For i In {0 : mx - 2}
      n = newsl;
      Surface Loop(n) = {fz[i + (mx - 1) * j], fz[i + (mx - 1) * (j + my - 1)], fy[i + (mx - 1) * j],
                         fy[i + (mx - 1) * (j + 1)], fx[i + mx * j], fx[i + 1 + mx * j]};
      v = newv; Volume(v) = {n};
      volumes~{body}[] += v;
    EndFor
  EndFor
  Transfinite Surface{fx[], fy[], fz[]};
  Transfinite Volume{volumes~{body}[]};
  Recombine Surface{fx[], fy[], fz[]};
  cells = (mx - 1) * (my - 1);
  contact~{body}[] = {fz[{0 : cells - 1}]};
  far~{body}[] = {fz[{cells : 2 * cells - 1}]};
  sides~{body}[] = {}; ends~{body}[] = {};
  For i In {0 : mx - 2}
    sides~{body}[] += {fy[i], fy[i + (mx - 1) * (my - 1)]};
  EndFor
  For j In {0 : my - 2}
    ends~{body}[] += {fx[mx * j], fx[mx - 1 + mx * j]};
  EndFor
  contact~{body}[] = {};
  For j In {1 : my - 3}
    For i In {1 : mx - 3}
      contact~{body}[] += {fz[i + (mx - 1) * j]};
    EndFor
  EndFor
EndFor

Physical Volume("punch_body") = volumes_0[];
Physical Surface("punch_contact") = contact_0[];
Physical Surface("punch_top") = far_0[];
Physical Surface("punch_sides") = {sides_0[], ends_0[]};
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = contact_1[];
Physical Surface("strip_bottom") = far_1[];
Physical Surface("strip_sides") = sides_1[];
Physical Surface("strip_ends") = ends_1[];
