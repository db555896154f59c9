!! The undamped modes K φ = λ M φ, φᵀ M φ = 1, λ = ω², of a machine over a parameter: each followed by its shape from value to
!! value.
!!
!! A step is taken if every mode keeps its shape (assurance criterion at least `least_likeness`), no two modes change
!! places, meet or part, and what is watched stays what it was; otherwise it is halved, down to `finest` of the range. So
!! modes that veer are told from modes that cross, and both are found where they are, whatever the step asked for: along a
!! branch the frequency is continuous, and at a veering its shape turns into that of the other branch. Veerings narrower
!! than `finest` pass for crossings, and modes that change places and back within one step for modes that do not meet.
!! Where a branch has the value that is looked for, its parameter is found to rounding.
!!
!! The share of coordinate i in mode φ is φ_i (M φ)_i. The shares of a mode add up to 1, and for a diagonal M they are the
!! parts of its kinetic energy; the shares of a coordinate in all modes add up to 1 too. With mass coupling a share can be
!! negative.
module razy_eigen_mode_branches
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, pi, wp
   use razy_core_number, only: to_text
   use razy_core_resize, only: resize
   use razy_eigen_branches, only: family_t, find_crossing, follow, line_t, walk_t
   use razy_eigen_spectrum, only: new_spectrum, spectrum_t
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, modes_found, modes_not_definite
   implicit none(type, external)
   private

   public :: branches_t, energy_shares, follow_branches, hertz, machines_t, watch_t

   real(wp), parameter :: least_likeness = 0.9_wp, finest = 1.0e-9_wp
   !> Values nearer than this part of the largest cannot be told apart.
   real(wp), parameter :: coincident = 1.0e-11_wp
   !> Shares that differ by less count as equal: next to a crossing, rounding mixes the shapes by this much.
   real(wp), parameter :: tie = 1.0e-5_wp
   !> Points that may be taken for each value that is asked for, and in all where there are few.
   integer, parameter :: most_per_value = 60, most_for_few = 20000

   !> Machines with a parameter.
   type, abstract, extends(family_t) :: machines_t
   contains
      procedure(matrices), deferred :: matrices
      procedure :: solve
   end type machines_t

   abstract interface
      !> M and K of the machine with this value of the parameter; an error if there is none.
      subroutine matrices(self, parameter, mass, stiffness, error)
         import :: error_t, machines_t, wp
         implicit none(type, external)
         class(machines_t), intent(inout) :: self
         real(wp), intent(in) :: parameter
         real(wp), allocatable, intent(out) :: mass(:, :), stiffness(:, :)
         type(error_t), allocatable, intent(out) :: error
      end subroutine matrices
   end interface

   !> What is looked for: the mode with the greatest share of `coordinate` if that is not 0, else mode number `mode` at the start.
   type :: watch_t
      integer :: coordinate = 0, mode = 0
      !> λ = ω² that it shall have, 1/s².
      real(wp) :: goal = 0.0_wp
   end type watch_t

   !> All modes at one value by their branches: λ, place in ascending order, of those that coincide the first, share of the
   !> coordinate looked for (of the strongest, where a mode is looked for), whether it is what is looked for: of all modes the
   !> one with most of the coordinate, or the branch of the mode. The mode watched, and the coordinate with the greatest share
   !> in it; 0: not known.
   type :: front_t
      real(wp) :: parameter = 0.0_wp
      real(wp), allocatable :: value(:), share(:)
      integer, allocatable :: place(:)
      logical, allocatable :: fits(:)
      integer :: branch = 0, coordinate = 0
   end type front_t

   !> A point on the way, and the mode watched there: branch, place in ascending order, strongest coordinate, share of the
   !> coordinate looked for (of the strongest, where a mode is looked for).
   type :: point_t
      real(wp) :: parameter = 0.0_wp
      integer :: branch = 0, place = 0, coordinate = 0
      real(wp) :: share = 0.0_wp
      !> Whether this value of the parameter was asked for.
      logical :: asked = .false.
   end type point_t

   !> Where a branch has the value looked for: parameter, λ, share as above, branch, whether it is the mode watched.
   type :: root_t
      real(wp) :: parameter = 0.0_wp, value = 0.0_wp, share = 0.0_wp
      integer :: branch = 0
      logical :: watched = .false.
   end type root_t

   !> The branches, numbered by rising frequency at the start.
   type, extends(walk_t) :: branches_t
      !> Points, by rising parameter once all is followed, and λ there (branch, point).
      type(point_t), allocatable :: point(:)
      real(wp), allocatable :: value(:, :)
      type(root_t), allocatable :: root(:)
      !> Whether every step could be made fine enough.
      logical :: resolved = .true.
      integer, private :: most = 0
      real(wp), private :: resolution = 0.0_wp
      type(watch_t), private :: watch
      !> Where the walk is.
      type(front_t), private :: front
   contains
      procedure :: is_fine
      procedure :: take
   end type branches_t

contains

   !> All modes for a value of the parameter.
   subroutine solve(self, parameter, spectrum, error)
      class(machines_t), intent(inout) :: self
      real(wp), intent(in) :: parameter
      type(spectrum_t), intent(out) :: spectrum
      type(error_t), allocatable, intent(out) :: error

      type(eigenpairs_t) :: modes
      real(wp), allocatable :: mass(:, :), stiffness(:, :)

      call self%matrices(parameter, mass, stiffness, error)
      if (allocated(error)) return
      modes = dense_modes(stiffness, mass)
      if (modes%status == modes_not_definite) then
         call raise(error, "the mass matrix is not positive definite at the value "//to_text(parameter))
      else if (modes%status /= modes_found) then
         call raise(error, "the eigenproblem could not be solved at the value "//to_text(parameter))
      else
         spectrum = new_spectrum(parameter, cmplx(modes%value, kind=wp), cmplx(modes%vector, kind=wp), 0.0_wp, &
                                 coincident*maxval(abs(modes%value)), mass)
      end if
   end subroutine solve

   !> Follow all modes from `start` over the values `grid` (ascending or descending), in both directions if need be.
   subroutine follow_branches(self, family, start, grid, watch, error)
      type(branches_t), intent(out) :: self
      class(machines_t), intent(inout) :: family
      real(wp), intent(in) :: start, grid(:)
      type(watch_t), intent(in) :: watch
      type(error_t), allocatable, intent(out) :: error

      type(spectrum_t) :: at_start, spectrum
      type(front_t) :: first
      real(wp) :: target
      integer :: direction, i, n

      n = size(grid)
      self%watch = watch
      self%most = max(most_for_few, most_per_value*n)
      self%resolution = finest*(max(start, maxval(grid)) - min(start, minval(grid)))
      allocate (self%point(0), self%root(0), self%value(0, 0))
      call family%solve(start, at_start, error)
      if (allocated(error)) return
      first = front_of(at_start, watch, self%front)
      call record(self, first)
      self%point(1)%asked = any(.not. abs(grid - start) > 0.0_wp)
      do i = 1, size(first%value)
         if (is_root(first%value(i)/watch%goal - 1)) call add_root(self, first, i)
      end do
      do direction = 1, -1, -2
         self%front = first
         spectrum = at_start
         do i = 1, n
            target = grid(merge(i, n + 1 - i, grid(n) > grid(1) .eqv. direction > 0))
            if (.not. direction*(target - start) > 0.0_wp) cycle
            call follow(self, family, spectrum, target, error)
            if (allocated(error)) return
            self%point(size(self%point))%asked = .true.
         end do
         ! The second direction goes on from the first point.
         n = size(self%point)
         self%point = self%point(n:1:-1)
         self%value = self%value(:, n:1:-1)
         n = size(grid)
      end do
   end subroutine follow_branches

   !> The modes of a spectrum, the mode watched and its strongest coordinate. In a tie these stay what they were at the point
   !> `before`.
   function front_of(spectrum, watch, before) result(front)
      type(spectrum_t), intent(in) :: spectrum
      type(watch_t), intent(in) :: watch
      type(front_t), intent(in) :: before
      type(front_t) :: front

      real(wp), allocatable :: share(:, :)
      integer :: b, branch, coordinate

      share = energy_shares(real(spectrum%shape, wp), spectrum%metric)
      front%parameter = spectrum%parameter
      front%value = real(spectrum%value, wp)
      front%place = spectrum%first
      front%value(spectrum%branch) = front%value
      front%place(spectrum%branch) = front%place
      share(:, spectrum%branch) = share
      branch = merge(before%branch, watch%mode, before%branch > 0)
      if (watch%coordinate > 0) then
         front%share = share(watch%coordinate, :)
         front%fits = front%share >= maxval(front%share) - tie
         if (before%branch == 0 .or. .not. front%fits(max(1, before%branch))) branch = maxloc(front%share, dim=1)
      else
         front%share = maxval(share, dim=1)
         front%fits = [(b == watch%mode, b=1, size(front%value))]
      end if
      coordinate = maxloc(share(:, branch), dim=1)
      if (before%coordinate > 0) then
         if (share(coordinate, branch) - share(before%coordinate, branch) <= tie) coordinate = before%coordinate
      end if
      front%branch = branch
      front%coordinate = coordinate
   end function front_of

   !> Whether a step need not be halved, or cannot.
   function is_fine(self, before, after)
      class(branches_t), intent(inout) :: self
      type(spectrum_t), intent(in) :: before, after
      logical :: is_fine

      type(front_t) :: next
      integer :: b

      next = front_of(after, self%watch, self%front)
      is_fine = minval(after%likeness) >= least_likeness .and. next%branch == self%front%branch &
                .and. (next%coordinate == self%front%coordinate .or. self%watch%coordinate > 0)
      do b = 1, size(next%place)
         ! Branches that change places, meet or part.
         is_fine = is_fine .and. all((next%place > next%place(b)) .eqv. (self%front%place > self%front%place(b)))
      end do
      if (is_fine .or. .not. abs(after%parameter - before%parameter) > self%resolution) then
         is_fine = .true.
      else
         self%resolved = self%resolved .and. size(self%point) < self%most
         is_fine = .not. self%resolved
      end if
   end function is_fine

   !> Record a step, and the roots in it.
   subroutine take(self, family, before, after, error)
      class(branches_t), intent(inout) :: self
      class(family_t), intent(inout) :: family
      type(spectrum_t), intent(in) :: before
      type(spectrum_t), intent(inout) :: after
      type(error_t), allocatable, intent(out) :: error

      type(front_t) :: next
      type(spectrum_t) :: at
      real(wp) :: f(2)
      integer :: b, place

      next = front_of(after, self%watch, self%front)
      do b = 1, size(next%value)
         f = [self%front%value(b), next%value(b)]/self%watch%goal - 1
         if (is_root(f(2))) call add_root(self, next, b)
         if (is_root(f(1)) .or. is_root(f(2)) .or. (f(1) < 0.0_wp .eqv. f(2) < 0.0_wp)) cycle
         call find_crossing(family, before, after, b, line_t(cmplx(1/self%watch%goal, kind=wp), 0.0_wp, -1.0_wp), at, place, error)
         if (allocated(error)) return
         call add_root(self, front_of(at, self%watch, self%front), b)
      end do
      call record(self, next)
      self%front = next
   end subroutine take

   !> Whether λ/goal - 1 is zero to rounding.
   pure function is_root(f)
      real(wp), intent(in) :: f
      logical :: is_root

      is_root = abs(f) <= epsilon(1.0_wp)
   end function is_root

   subroutine add_root(self, at, branch)
      type(branches_t), intent(inout) :: self
      type(front_t), intent(in) :: at
      integer, intent(in) :: branch

      self%root = [self%root, root_t(at%parameter, at%value(branch), at%share(branch), branch, at%fits(branch))]
   end subroutine add_root

   !> Append a point.
   subroutine record(self, front)
      type(branches_t), intent(inout) :: self
      type(front_t), intent(in) :: front

      integer :: n

      n = size(self%point)
      if (size(self%value, 2) <= n) call resize(self%value, size(front%value), 64_i8 + 2*n)
      self%value(:, n + 1) = front%value
      associate (b => front%branch)
         self%point = [self%point, point_t(front%parameter, b, front%place(b), front%coordinate, front%share(b))]
      end associate
   end subroutine record

   !> Shares (coordinate, mode) of the coordinates in modes (n, modes) with φᵀ M φ = 1.
   pure function energy_shares(shape, mass) result(share)
      real(wp), intent(in) :: shape(:, :), mass(:, :)
      real(wp), allocatable :: share(:, :)

      share = shape*matmul(mass, shape)
   end function energy_shares

   !> Natural frequency, Hz, of λ = ω²; negative for an unstable λ < 0.
   elemental function hertz(value)
      real(wp), intent(in) :: value
      real(wp) :: hertz

      hertz = sign(sqrt(abs(value)), value)/(2*pi)
   end function hertz

end module razy_eigen_mode_branches
