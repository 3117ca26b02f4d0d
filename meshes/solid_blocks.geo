// Two boxes of the same ground plan on each other, in space: the simplest solids, for exact solutions.
//
// Lengths in mm; x and y from their middle, z up from the contact. Structured hexahedra, or tetrahedra.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.

DefineConstant[
  width = 1,              // along x
  depth = 1,              // along y
  punch_height = 1,
  strip_height = 1,
  margin_x = 0,           // by which the strip is wider on each side
  margin_y = 0,           // by which it is deeper
  quarter = 0,            // 1: only x >= 0 and y >= 0, with the planes of symmetry as groups
  across_x = 2,           // elements over the width, or over its half of a quarter
  across_y = 2,
  strip_across_x = 0,     // of the strip where it has others than the punch; 0: the same
  strip_across_y = 0,
  margin_elements = 2,    // over each margin
  spread = 1,             // of such an element's width over that of its neighbour towards the contact
  punch_layers = 2,       // elements over the height
  strip_layers = 2,
  growth = 1,             // of an element's height over that of its neighbour towards the contact
  punch_tetrahedra = 0,   // 1: tetrahedra in place of hexahedra
  strip_tetrahedra = 0,
  diffusion_length = 0    // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(width <= 0 || depth <= 0 || punch_height <= 0 || strip_height <= 0 || margin_x < 0 || margin_y < 0)
  Error("width, depth, punch_height and strip_height must be positive, margin_x and margin_y not negative");
EndIf
If(across_x < 1 || across_y < 1 || margin_elements < 1 || punch_layers < 1 || strip_layers < 1)
  Error("across_x, across_y, margin_elements, punch_layers and strip_layers must be at least 1");
EndIf
If(growth <= 0 || spread <= 0)
  Error("growth and spread must be positive");
EndIf

// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * ((width < depth) ? width : depth));
whole = 0;
For i In {0 : strip_layers - 1}
  whole += growth^i;
EndFor
top_growth = growth;
If(layer > 0 && strip_height / whole > layer)
  top_growth = (growth > 1.5) ? growth : 1.5;
  top_count = Ceil(Log(1 + (top_growth - 1) * strip_height / layer) / Log(top_growth));
  strip_layers = (top_count > strip_layers) ? top_count : strip_layers;
EndIf
growths[] = {growth, top_growth};

heights[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
across_x[] = {across_x, (strip_across_x > 0) ? strip_across_x : across_x};
across_y[] = {across_y, (strip_across_y > 0) ? strip_across_y : across_y};
tetrahedra[] = {punch_tetrahedra, strip_tetrahedra};
For body In {0 : 1}
  // Lines of the grid along x and y, the elements between them and the ratio of their sizes.
  x[] = {}; y[] = {}; nx[] = {}; ny[] = {}; grade_x[] = {}; grade_y[] = {};
  If(body == 1 && margin_x > 0 && !quarter)
    x[] += {-width / 2 - margin_x}; nx[] += margin_elements; grade_x[] += 1 / spread;
  EndIf
  x[] += {quarter ? 0 : -width / 2, width / 2}; nx[] += across_x[body]; grade_x[] += 1;
  If(body == 1 && margin_x > 0)
    x[] += {width / 2 + margin_x}; nx[] += margin_elements; grade_x[] += spread;
  EndIf
  If(body == 1 && margin_y > 0 && !quarter)
    y[] += {-depth / 2 - margin_y}; ny[] += margin_elements; grade_y[] += 1 / spread;
  EndIf
  y[] += {quarter ? 0 : -depth / 2, depth / 2}; ny[] += across_y[body]; grade_y[] += 1;
  If(body == 1 && margin_y > 0)
    y[] += {depth / 2 + margin_y}; ny[] += margin_elements; grade_y[] += spread;
  EndIf
  mx = #x[]; my = #y[];

  // Points, lines along x, y and z, faces and volumes by their place in the grid.
  p[] = {}; lx[] = {}; ly[] = {}; lz[] = {}; fx[] = {}; fy[] = {}; fz[] = {}; volumes~{body}[] = {};
  For k In {0 : 1}
    For j In {0 : my - 1}
      For i In {0 : mx - 1}
        n = newp; Point(n) = {x[i], y[j], k * heights[body]};
        p[] += n;
      EndFor
    EndFor
  EndFor
  For k In {0 : 1}
    For j In {0 : my - 1}
      For i In {0 : mx - 2}
        l = newl; Line(l) = {p[i + mx * (j + my * k)], p[i + 1 + mx * (j + my * k)]};
        Transfinite Curve{l} = nx[i] + 1 Using Progression grade_x[i];
        lx[] += l;
      EndFor
    EndFor
    For j In {0 : my - 2}
      For i In {0 : mx - 1}
        l = newl; Line(l) = {p[i + mx * (j + my * k)], p[i + mx * (j + 1 + my * k)]};
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
        s = news; Plane Surface(s) = {n};
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
  If(tetrahedra[body] == 0)
    Recombine Surface{fx[], fy[], fz[]};
  EndIf
  cells = (mx - 1) * (my - 1);
  contact~{body}[] = {fz[{0 : cells - 1}]};
  far~{body}[] = {fz[{cells : 2 * cells - 1}]};
  sides~{body}[] = {}; ends~{body}[] = {}; middle_x~{body}[] = {}; middle_y~{body}[] = {};
  For i In {0 : mx - 2}
    middle_y~{body}[] += fy[i]; ends~{body}[] += fy[i + (mx - 1) * (my - 1)];
  EndFor
  For j In {0 : my - 2}
    middle_x~{body}[] += fx[mx * j]; sides~{body}[] += fx[mx - 1 + mx * j];
  EndFor
  If(!quarter)
    sides~{body}[] += middle_x~{body}[]; ends~{body}[] += middle_y~{body}[];
  EndIf
EndFor

Physical Volume("punch_body") = volumes_0[];
Physical Surface("punch_contact") = contact_0[];
Physical Surface("punch_far") = far_0[];
Physical Surface("punch_sides") = sides_0[];      // of normal x
Physical Surface("punch_ends") = ends_0[];        // of normal y
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = contact_1[];
Physical Surface("strip_far") = far_1[];
Physical Surface("strip_sides") = sides_1[];
Physical Surface("strip_ends") = ends_1[];
If(quarter)
  Physical Surface("punch_middle_x") = middle_x_0[];    // x = 0
  Physical Surface("punch_middle_y") = middle_y_0[];
  Physical Surface("strip_middle_x") = middle_x_1[];
  Physical Surface("strip_middle_y") = middle_y_1[];
EndIf
