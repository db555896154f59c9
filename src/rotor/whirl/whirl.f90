!! Whirl of rotors, as eigenvalues lambda and shapes of M y'' + (B + Bx + Omega G) y' + (K + Kx + Omega C) y = 0
!! at a speed Omega, in the undamped modes at rest.
module razy_rotor_whirl_whirl
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_eigen_decay, only: forms_t
   use razy_eigen_damped, only: damped_eigen, modal_scaling
   use razy_eigen_free_modes, only: modes_beside
   use razy_eigen_path, only: eigen_path_t
   use razy_eigen_spectrum, only: new_spectrum, spectrum_t
   use razy_linalg_dense, only: add_outer
   use razy_linalg_generalised, only: modes_found
   use razy_linalg_lapack, only: zgesv, zheev
   use razy_linalg_pattern, only: connected_sets
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: reduced_t, transformed
   use razy_rotor_whirl_family, only: whirl_family_t
   implicit none(type, external)
   private

   public :: equal, new_whirl, separate_whirl, whirl_direction, whirl_problem_t

   !> Lateral motion below this share of a shape is rounding.
   real(wp), parameter :: still = 1.0e-6_wp
   !> Eigenvalues apart by less than this share of their size are degenerate.
   real(wp), parameter :: equal = 1.0e-7_wp

   !> The problem over the speed, rad/s, and what of it does not depend on that. Shapes of its spectra (p, values) are in
   !> modes at rest times their frequencies; `shape_of` turns them into shapes of the model.
   type, extends(whirl_family_t) :: whirl_problem_t
      !> Whether the modes at rest were found.
      logical :: complete = .true.
      !> The model in its modes, M = 1 and K = diag(omega²), meshes in it if they are closed.
      type(reduced_t) :: modal
      !> omega², (rad/s)², and the scaling S of razy_eigen_damped, rad/s (p each).
      real(wp), allocatable :: squared(:), scaling(:)
      !> B + Bx with the meshes, if they are closed (p, p).
      real(wp), allocatable :: damping(:, :)
      !> The speeds solved last.
      type(eigen_path_t) :: path
   contains
      procedure :: solve
      procedure :: shape_of
      procedure :: vector_of
      procedure :: shape_from
      procedure :: newton
      procedure :: forms_of
      procedure :: damping_at
      procedure :: cross_at
   end type whirl_problem_t

contains

   !> The problem of a reduced model; with `meshed` all meshes are closed and linear. Of the rigid motions `of_stiffness` (p, k)
   !> those of `untouched` (p, r) are left out.
   function new_whirl(reduced, meshed, of_stiffness, untouched) result(problem)
      type(reduced_t), intent(in) :: reduced
      logical, intent(in) :: meshed
      real(wp), intent(in), optional :: of_stiffness(:, :), untouched(:, :)
      type(whirl_problem_t) :: problem

      real(wp), allocatable :: basis(:, :), entries(:, :), free(:, :), rigid(:, :), stiffness(:, :)
      integer, allocatable :: part(:)
      integer :: i, status

      allocate (free(size(reduced%mass, 1), 0), rigid(size(reduced%mass, 1), 0))
      if (present(of_stiffness)) free = of_stiffness
      if (present(untouched)) rigid = untouched
      stiffness = reduced%stiffness
      if (meshed) stiffness = reduced%closed_stiffness()
      problem%untouched = size(rigid, 2)
      call modes_beside(stiffness, reduced%mass, free, rigid, problem%squared, basis, status)
      problem%complete = status == modes_found
      problem%modal = transformed(reduced, basis)
      problem%damping = problem%modal%damping
      if (meshed) problem%damping = problem%modal%closed_damping()
      problem%damping = problem%damping + problem%modal%cross_damping
      problem%scaling = modal_scaling(problem%squared)
      associate (modal => problem%modal)
         entries = abs(problem%damping) + abs(modal%gyroscopic) + abs(modal%cross_stiffness) + abs(modal%circulatory)
         do i = 1, size(modal%tabled)
            call add_outer(entries, 1.0_wp, sum(abs(modal%tabled(i)%row), dim=1))
         end do
      end associate
      part = connected_sets(entries > 0.0_wp)
      problem%largest = [(maxval(problem%scaling, part == part(i)), i=1, size(part))]
   end function new_whirl

   !> Omega G, with damping B + Bx + Omega G (p, p); with `rate` the derivative by Omega.
   pure function damping_at(self, speed, rate) result(damping)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: rate
      real(wp), allocatable :: damping(:, :)

      damping = merge(1.0_wp, speed, rate)*self%modal%gyroscopic
      if (.not. self%damped) return
      if (.not. rate) damping = damping + self%damping
      damping = damping + self%modal%bearing_change(speed, .true., rate, .true.)
   end function damping_at

   !> Kx, or Kx + Omega C if C acts, and what bearings have more of K and Kx than at their first speeds (p, p); with `rate` the
   !> derivative by Omega.
   pure function cross_at(self, speed, rate) result(cross)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      logical, intent(in) :: rate
      real(wp), allocatable :: cross(:, :)

      cross = self%modal%bearing_change(speed, .false., rate, self%damped)
      if (self%damped .and. .not. rate) cross = cross + self%modal%cross_stiffness
      if (self%circulatory) cross = cross + merge(1.0_wp, speed, rate)*self%modal%circulatory
   end function cross_at

   !> Eigenvalues with imaginary part >= 0, 1/s and rad/s, in the order of their imaginary parts, and shapes at the angular speed
   !> `parameter` of the system, rad/s.
   subroutine solve(self, parameter, spectrum, error)
      class(whirl_problem_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      type(spectrum_t), intent(out) :: spectrum
      type(error_t), allocatable, intent(out) :: error

      complex(wp), allocatable :: shape(:, :), value(:)
      integer :: info

      info = merge(0, 1, self%complete)
      if (info == 0) then
         call damped_eigen(self%squared, self%damping_at(parameter, rate=.false.), value, info, &
                           self%cross_at(parameter, rate=.false.), shape, self%path, parameter)
      end if
      if (info /= 0) then
         call raise(error, "an eigenproblem could not be solved")
      else
         spectrum = new_spectrum(parameter, value, shape, equal, 0.0_wp)
      end if
   end subroutine solve

   !> A shape (n) in the coordinates of the unreduced model from one in modes at rest (p).
   function shape_of(self, shape) result(moved)
      class(whirl_problem_t), intent(in) :: self
      complex(wp), intent(in) :: shape(:)
      complex(wp), allocatable :: moved(:)

      associate (basis => self%modal%basis)
         moved = cmplx(matmul(basis, shape%re/self%scaling), matmul(basis, shape%im/self%scaling), wp)
      end associate
   end function shape_of

   function vector_of(self, from) result(to)
      class(whirl_problem_t), intent(in) :: self
      complex(wp), intent(in) :: from(:)
      complex(wp) :: to(size(from))

      to = from/self%scaling
   end function vector_of

   function shape_from(self, from) result(to)
      class(whirl_problem_t), intent(in) :: self
      complex(wp), intent(in) :: from(:)
      complex(wp) :: to(size(from))

      to = self%scaling*from
   end function shape_from

   !> See `whirl_family_t`.
   subroutine newton(self, lambda, speed, u, right, info)
      class(whirl_problem_t), intent(in) :: self
      complex(wp), intent(in) :: lambda, u(:)
      real(wp), intent(in) :: speed
      complex(wp), intent(out) :: right(:, :)
      integer, intent(out) :: info

      complex(wp) :: matrix(size(u), size(u))
      integer :: i, p, pivot(size(u))

      p = size(u)
      matrix = self%damping_at(speed, rate=.false.)
      right(:, 1) = matmul(matrix, u) + 2*lambda*u
      right(:, 2) = lambda*matmul(self%damping_at(speed, rate=.true.), u) + matmul(self%cross_at(speed, rate=.true.), u)
      matrix = lambda*matrix + self%cross_at(speed, rate=.false.)
      do i = 1, p
         matrix(i, i) = matrix(i, i) + self%squared(i) + lambda**2
      end do
      call zgesv(p, 2, matrix, p, pivot, right, p, info)
   end subroutine newton

   !> See `whirl_family_t`.
   function forms_of(self, speed, u) result(forms)
      class(whirl_problem_t), intent(in) :: self
      real(wp), intent(in) :: speed
      complex(wp), intent(in) :: u(:)
      type(forms_t) :: forms

      real(wp), allocatable :: cross(:, :), damping(:, :)
      real(wp) :: moved(size(u))

      moved = abs(u)
      ! Without gyroscopic moments, of which rounding would be left.
      damping = self%damping + self%modal%bearing_change(speed, .true., .false., .true.)
      cross = self%cross_at(speed, rate=.false.)
      forms%mass = sum(moved**2)
      forms%stiffness = sum(self%squared*moved**2) + real(dot_product(u, matmul(cross, u)), wp)
      forms%damping = real(dot_product(u, matmul(damping, u)), wp)
      forms%cross = aimag(dot_product(u, matmul(cross, u)))
      forms%damping_terms = dot_product(moved, matmul(abs(damping), moved))
      forms%cross_terms = dot_product(moved, matmul(abs(cross), moved))
      forms%cross_reach = norm2(abs(matmul(cross, u))/self%scaling)*norm2(self%scaling*moved)
   end function forms_of

   !> How nodes turn on their orbits in a shape (n) with Im(lambda) > 0, over all shafts: +1 forward (with the
   !> rotation of their shaft), -1 backward, 0 on straight lines or without lateral motion; between, orbits are ellipses or nodes
   !> differ.
   pure function whirl_direction(model, shape) result(direction)
      type(rotor_model_t), intent(in) :: model
      complex(wp), intent(in) :: shape(:)
      real(wp) :: direction

      complex(wp) :: turned(size(shape))
      real(wp) :: extent

      turned = quarter_turned(model, shape)
      extent = sum(abs(turned)**2)
      direction = 0.0_wp
      if (extent > still**2*sum(abs(shape)**2)) direction = real(dot_product(shape, turned), wp)/extent
   end function whirl_direction

   !> Shapes of equal eigenvalues, of which any combination is one, become those that turn most: backward ones before forward ones,
   !> on circles where both planes are alike.
   subroutine separate_whirl(spectrum, family, model)
      type(spectrum_t), intent(inout) :: spectrum
      class(whirl_family_t), intent(in) :: family
      type(rotor_model_t), intent(in) :: model

      complex(wp), allocatable :: form(:, :), shape(:, :), turned(:, :), work(:)
      real(wp), allocatable :: value(:), work_real(:)
      integer :: i, info, k, last, m

      do i = 1, size(spectrum%value)
         m = count(spectrum%first == i)
         if (m < 2) cycle
         last = i + m - 1
         allocate (shape(model%numbering%n, m), turned(model%numbering%n, m), value(m), work(2*m), work_real(3*m))
         do k = 1, m
            shape(:, k) = family%shape_of(spectrum%shape(:, i + k - 1))
            turned(:, k) = quarter_turned(model, shape(:, k))
         end do
         form = matmul(conjg(transpose(shape)), turned)
         call zheev("V", "U", m, form, m, value, work, size(work), work_real, info)
         if (info == 0) spectrum%shape(:, i:last) = matmul(spectrum%shape(:, i:last), form)
         deallocate (shape, turned, value, work, work_real)
      end do
   end subroutine separate_whirl

   !> Lateral motions of a shape (n) turned by a right angle in the plane and by one in time: a circle that is run through with the
   !> rotation of its shaft stays as it is, one against it changes its sign.
   pure function quarter_turned(model, shape) result(turned)
      type(rotor_model_t), intent(in) :: model
      complex(wp), intent(in) :: shape(:)
      complex(wp) :: turned(size(shape))

      complex(wp) :: quarter
      integer :: at(6), node, s

      turned = 0.0_wp
      do s = 1, size(model%rotor%shaft)
         ! v = cos, w = sin, that is (1, -i), turns from y to z.
         quarter = cmplx(0.0_wp, sign(1.0_wp, model%rotor%shaft(s)%speed_ratio), wp)
         do node = 1, model%rotor%shaft(s)%nodes()
            at = model%numbering%of(s, node)
            if (at(2) == 0 .or. at(3) == 0) cycle
            turned(at(2)) = quarter*shape(at(3))
            turned(at(3)) = -quarter*shape(at(2))
         end do
      end do
   end function quarter_turned

end module razy_rotor_whirl_whirl
