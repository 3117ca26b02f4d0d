// A shaft in the whole bore of a bushing, as solids, in line or not. Structured hexahedra.
//
// Lengths in mm, angles in degrees; the shaft's axis is y, at x = z = 0, and the bushing's middle lies at y = 0, z up. In
// line both touch along the top. The elements are even within fine_angle of it, and coarser beyond.
// Physical groups: every name starts with the body it belongs to, punch_ (the bushing) or strip_ (the shaft).
// The case file gives each parameter below a value of its own by name. Its geometry.order = 2 makes the
// elements follow the circles.

DefineConstant[
  radius = 10,              // of the shaft
  clearance = 0.05,         // the bushing's bore has the radius + clearance
  wall = 4,                 // of the bushing
  shaft_wall = 6,           // of the part of the shaft that is meshed, below radius
  length = 20,              // of the bushing
  overhang = 4,             // of the shaft on each side; 0: a slice, whose ends may be held
  misalignment = 0,         // by which the bushing is turned about x, towards -z at larger y
  fine_angle = 60,          // to both sides, below 180
  fine_elements = 24,       // within fine_angle of both sides, even
  beyond_elements = 6,      // from there to the bottom, on each side
  along = 8,                // over the bushing's length, even
  overhang_elements = 2,
  wall_layers = 2,
  shaft_layers = 3
];

If(clearance < 0)
  Error("clearance must not be negative: the shaft would be larger than its bore");
EndIf
If(radius <= 0 || clearance >= 0.2 * radius || wall <= 0 || shaft_wall <= 0 || shaft_wall >= radius)
  Error("radius, wall and shaft_wall must be positive, shaft_wall and clearance small against radius");
EndIf
If(length <= 0 || overhang < 0 || Fabs(misalignment) > 2)
  Error("length must be positive, overhang at least 0, and misalignment at most 2 degrees");
EndIf
If(misalignment != 0 && overhang <= 0)
  Error("a bushing that is not in line needs an overhang of the shaft");
EndIf
If(fine_angle <= 0 || fine_angle >= 170 || fine_elements < 2 || fine_elements % 2 || beyond_elements < 1)
  Error("fine_angle must lie between 0 and 170, fine_elements be even, beyond_elements at least 1");
EndIf
If(along < 2 || along % 2 || overhang_elements < 1 || wall_layers < 1 || shaft_layers < 1)
  Error("along must be even, overhang_elements, wall_layers and shaft_layers at least 1");
EndIf

degree = Pi / 180;
near[] = {radius + clearance, radius};
far[] = {radius + clearance + wall, radius - shaft_wall};
centres[] = {-clearance, 0};    // the bushing rests on the shaft's top
layers[] = {wall_layers, shaft_layers};
angles[] = {fine_angle, (fine_angle + 180) / 2, 180};
counts[] = {fine_elements / 2, Ceil(beyond_elements / 2), Floor(beyond_elements / 2) > 0 ? Floor(beyond_elements / 2) : 1};
For body In {0 : 1}
  z = centres[body];
  o = newp; Point(o) = {0, 0, z};
  p = newp; Point(p) = {0, 0, z + near[body]}; near_middle = p;
  p = newp; Point(p) = {0, 0, z + far[body]}; far_middle = p; top~{body} = p;
  l = newl; Line(l) = {near_middle, far_middle}; middle = l; Transfinite Curve{l} = layers[body] + 1;
  faces~{body}[] = {}; volumes~{body}[] = {}; contact~{body}[] = {}; outer~{body}[] = {}; tips~{body}[] = {};
  For side In {0 : 1}
    a0 = near_middle; b0 = far_middle; inner = middle;
    For i In {0 : 2}
      If(side == 1 && i == 2)    // the way around is closed
        a1 = a_closed; b1 = b_closed; l = l_closed;
      Else
        angle = (2 * side - 1) * angles[i] * degree;
        p = newp; Point(p) = {near[body] * Sin(angle), 0, z + near[body] * Cos(angle)}; a1 = p;
        p = newp; Point(p) = {far[body] * Sin(angle), 0, z + far[body] * Cos(angle)}; b1 = p;
        l = newl; Line(l) = {a1, b1}; Transfinite Curve{l} = layers[body] + 1;
        If(side == 0)
          a_closed = a1; b_closed = b1; l_closed = l;
        EndIf
      EndIf
      a = newl; Circle(a) = {a0, o, a1};
      b = newl; Circle(b) = {b0, o, b1};
      Transfinite Curve{a, b} = counts[i] + 1;
      k = newll; Curve Loop(k) = {a, l, -b, -inner};
      s = news; Plane Surface(s) = {k}; Transfinite Surface{s}; Recombine Surface{s};
      faces~{body}[] += s;
      a0 = a1; b0 = b1; inner = l;
    EndFor
  EndFor
EndFor
For body In {0 : 1}
  For way In {0 : 1}         // to both sides of y = 0
    sign = 2 * way - 1; ends[] = faces~{body}[];
    For piece In {0 : (body == 1 && overhang > 0) ? 1 : 0}
      If(piece == 0)
        part[] = Extrude {0, sign * length / 2, 0} { Surface{ends[]}; Layers{along / 2}; Recombine; };
      Else
        part[] = Extrude {0, sign * overhang, 0} { Surface{ends[]}; Layers{overhang_elements}; Recombine; };
      EndIf
      ends[] = {};
      For k In {0 : 5}
        ends[] += part[6 * k]; volumes~{body}[] += part[6 * k + 1];
        For j In {2 : 5}     // which of the sides lies on which circle
          q[] = PointsOf{ Surface{part[6 * k + j]}; };
          inside = 1; outside = 1;
          For i In {0 : #q[] - 1}
            c[] = Point{q[i]};
            r = Sqrt(c[0]^2 + (c[2] - centres[body])^2);
            inside = inside && Fabs(r - near[body]) < 1e-6 * radius; outside = outside && Fabs(r - far[body]) < 1e-6 * radius;
          EndFor
          If(inside)
            contact~{body}[] += part[6 * k + j];
          ElseIf(outside)
            outer~{body}[] += part[6 * k + j];
          EndIf
        EndFor
      EndFor
    EndFor
    tips~{body}[] += ends[];
  EndFor
EndFor
If(misalignment != 0)
  Rotate {{1, 0, 0}, {0, 0, -clearance}, -misalignment * degree} { Volume{volumes_0[]}; }
EndIf

// ---- The contract: named physical groups ------------------------------------------------------
Physical Volume("punch_body") = volumes_0[];
Physical Surface("punch_contact") = contact_0[];
Physical Surface("punch_top") = outer_0[];            // the outer side, which the housing presses
Physical Surface("punch_ends") = tips_0[];
Physical Point("punch_middle") = top_0;               // outside, above the middle
Physical Volume("strip_body") = volumes_1[];
Physical Surface("strip_contact") = contact_1[];
Physical Surface("strip_bottom") = outer_1[];         // inside the shaft
Physical Surface("strip_ends") = tips_1[];
