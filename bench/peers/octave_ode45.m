% Peer: Octave's ode45 on P2, the way of the thesis: an adaptive Runge-Kutta method straight over the kinks of the mesh force.
% usage: octave-cli octave_ode45.m p2 through:RTOL FIRST LAST STEP OUTPUT   (RTOL "default": Octave's own tolerances)
1;

function rate = right_hand_side(t, y, omega, m)
  d = m.radius * (y(2) - y(3)) + m.error_sine * sin(omega * t);
  force = m.mesh * (max(d, 0) + min(d + m.backlash, 0));
  rate = [y(5:8); m.inverse_mass * (m.load - m.damping * y(5:8) - m.stiffness * y(1:4) - m.direction * force)];
end

words = argv();
if numel(words) ~= 6 || ~strcmp(words{1}, "p2")
  error("usage: octave_ode45.m p2 through:RTOL FIRST LAST STEP OUTPUT");
end
setting = strsplit(words{2}, ":"){2};
rpm = str2double(words{3});
m.inverse_mass = diag(1 ./ [0.1, 0.00794, 0.00794, 0.1]);
shaft = [1, -1; -1, 1] * 6.2905e4;
m.stiffness = blkdiag(shaft, shaft);
m.damping = 5e-4 * m.stiffness;
m.radius = 0.08; m.mesh = 8e8; m.backlash = 1e-4; m.error_sine = 5e-5;
m.load = [100; 0; 0; -100];
m.direction = m.radius * [0; 1; -1; 0];
omega = 40 * pi * rpm / 30;
twist = 100 / 6.2905e4;
closing = 100 / (m.mesh * m.radius^2);
y0 = [closing / 2 + twist; closing / 2; -closing / 2; -closing / 2 - twist; zeros(4, 1)];
if strcmp(setting, "default")
  options = odeset();
else
  rtol = str2double(setting);
  options = odeset("RelTol", rtol, "AbsTol", rtol * [1e-3 * ones(4, 1); ones(4, 1)]);
end
start = cputime();
[t, y] = ode45(@(t, y) right_hand_side(t, y, omega, m), linspace(0, 0.2, 2001), y0, options);
used = cputime() - start;
d = m.radius * (y(:, 2) - y(:, 3)) + m.error_sine * sin(omega * t);
out = fopen(words{6}, "w");
fprintf(out, "d %.17g %.17g\n", [t, d]');
fprintf(out, "# cpu %.6f\n", used);
fclose(out);
