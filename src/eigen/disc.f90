!! Eigenvalues of λ² M + λ D + K nearest to 0 of large banded M, D and K, with a count that proves that none is missed.
!!
!! With x and y = λ x/c as the state, T = (A - σ)⁻¹ has the eigenvalues 1/(λ - σ), and one real factor of Q(σ) makes it, σ > 0. Its
!! largest are found by `razy_linalg_arnoldi`. A circle around σ through a gap of what was found has to hold as many as there are:
!!
!! - where K is symmetric and positive definite (beside the rigid motions) and D skew, all λ = i w are imaginary, and the number of
!!   0 < w < w₀ is the number of negative eigenvalues of the Hermitian K - w₀² M + i w₀ D: each falls through 0 once, as w rises
!!   (P. Lancaster, Lambda-Matrices and Vibrating Systems, 1966);
!! - else by the principle of the argument: h(s) = det Q(s)/Π(s - λ_j), over all λ_j found, turns about 0 once for each eigenvalue
!!   inside that was not, while s goes round the circle. The turn between two points is known up to whole ones; which it is says the
!!   rate at both, and arcs are halved until that fits. λ_j are divided out because only near them the rate changes fast.
!!
!! What is missed, copies of multiple eigenvalues as a rule, is looked for again beside what is known.
module razy_eigen_disc
   use razy_core_kinds, only: pi, wp
   use razy_linalg_arnoldi, only: enlarge_space, operator_t
   use razy_linalg_band_matrix, only: band_lu_t, band_t, quadratic_inertia, quadratic_pivots
   use razy_linalg_dense, only: rising_order
   use razy_linalg_eigen, only: right_eigen
   implicit none(type, external)
   private

   public :: disc_t

   !> Searches, and relative error of what is found.
   integer, parameter :: most_searches = 20
   real(wp), parameter :: tolerance = 1.0e-12_wp
   !> Distances from σ that differ less, relatively, are no gap.
   real(wp), parameter :: copy = 1.0e-6_wp
   !> The half circle in so many arcs. One is halved while h turns otherwise than the rates say by more than `off`, these differ by
   !> more than the next number on its length, rad each, or it is longer than the distance to the nearest λ_j; so often at most.
   integer, parameter :: arcs = 8
   real(wp), parameter :: off = 0.5_wp, bend = 3.0_wp
   integer, parameter :: most_halvings = 30
   !> Angle over which rates are measured, rad.
   real(wp), parameter :: short = 1.0e-5_wp
   !> Eigenvalues beyond those wanted, for the gap.
   integer, parameter :: beyond = 4

   !> Where on the circle, the direction of h there, and its rate of turning.
   type :: sample_t
      real(wp) :: angle = 0.0_wp, rate = 0.0_wp
      complex(wp) :: direction = (1.0_wp, 0.0_wp)
   end type sample_t

   !> The problem, bands of one width, and what was found so far.
   type, extends(operator_t) :: disc_t
      type(band_t) :: mass, damping, stiffness
      !> σ and c, rad/s.
      real(wp) :: shift = 1.0_wp, scale = 1.0_wp
      !> Motions R without K and D (n, r), Rᵀ M R = 1, and M R: their eigenvalues 0, in pairs, are left out.
      real(wp), allocatable :: rigid(:, :), momentum(:, :)
      !> Whether the first count above serves.
      logical :: gyroscopic = .false.
      type(band_lu_t), private :: factor
      !> How many were needed last, and a vector of what was found, to begin with.
      integer, private :: needed = 0
      real(wp), allocatable, private :: start(:)
   contains
      procedure :: apply
      procedure :: solve
      procedure :: count_missing
      procedure, private :: without_rigid
   end type disc_t

contains

   !> T of the state (2 n).
   subroutine apply(self, x, y)
      class(disc_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(out) :: y(:)

      real(wp) :: force(size(x)/2)

      associate (n => size(x)/2, sigma => self%shift, c => self%scale)
         force = 0.0_wp
         call self%mass%add_times(-(c*x(n + 1:) + sigma*x(:n)), force)
         call self%damping%add_times(-x(:n), force)
         call self%factor%solve(force)
         y(:n) = force
         y(n + 1:) = (x(:n) + sigma*force)/c
         call self%without_rigid(y)
      end associate
   end subroutine apply

   !> Take the rigid motions out of a state (2 n).
   subroutine without_rigid(self, state)
      class(disc_t), intent(in) :: self
      real(wp), intent(inout) :: state(:)

      associate (n => size(state)/2)
         state(:n) = state(:n) - matmul(self%rigid, matmul(state(:n), self%momentum))
         state(n + 1:) = state(n + 1:) - matmul(self%rigid, matmul(state(n + 1:), self%momentum))
      end associate
   end subroutine without_rigid

   !> Eigenvalues with Im >= 0 and their vectors (n, values): all with |λ| <= `radius`, rad/s, and at least the `least` of smallest
   !> modulus; others are among them.
   recursive subroutine solve(self, least, radius, value, vector, found)
      class(disc_t), intent(inout) :: self
      integer, intent(in) :: least
      real(wp), intent(in) :: radius
      complex(wp), allocatable, intent(out) :: value(:), vector(:, :)
      logical, intent(out) :: found

      complex(wp), allocatable :: all(:), shape(:, :)
      logical :: anew
      real(wp), allocatable :: space(:, :)
      real(wp) :: rho
      integer :: i, info, inside, n, search, wanted

      n = size(self%mass%entry, 2)
      found = .false.
      call self%factor%factor(self%stiffness, self%damping, self%mass, self%shift, info)
      if (info /= 0) return
      anew = .not. allocated(self%start)
      if (anew) self%start = [(sin(real(i, wp)**2), i=1, 2*n)]
      call self%without_rigid(self%start)
      allocate (space(2*n, 0))
      wanted = max(self%needed, 2*least + beyond)
      do search = 1, most_searches
         ! At least a pair.
         wanted = min(max(2, wanted), 2*(n - size(self%rigid, 2)) - beyond - size(space, 2))
         found = .false.
         if (wanted < 2) return
         call enlarge_space(self, space, wanted, self%start, tolerance, found)
         if (found) call pairs_of(self, space, all, shape, found)
         if (.not. found) return
         call choose_circle(all, self%shift, least, radius, rho, inside)
         wanted = max(beyond, size(space, 2)/2)
         if (inside == 0) cycle
         wanted = self%count_missing(all, inside, rho)
         if (wanted <= 0) exit
      end do
      found = wanted == 0
      if (.not. found) return
      self%needed = count(abs(all) <= max(radius, modulus_of(all, least))) + beyond
      self%start = matmul(space, [(1.0_wp/i, i=1, size(space, 2))])
      ! Motions of what has hardly any mass, as any vector has, have been left behind now.
      if (anew) call self%solve(least, radius, value, vector, found)
      if (anew) return
      associate (upper => pack([(i, i=1, inside)], all(:inside)%im >= 0.0_wp))
         value = all(upper)
         vector = shape(:, upper)
      end associate
   end subroutine solve

   !> The eigenvalues in an invariant subspace (2 n, m) by rising distance from σ, and their vectors (n, m).
   subroutine pairs_of(self, space, value, vector, found)
      class(disc_t), intent(in) :: self
      real(wp), intent(in) :: space(:, :)
      complex(wp), allocatable, intent(out) :: value(:), vector(:, :)
      logical, intent(out) :: found

      complex(wp), allocatable :: small(:, :)
      real(wp), allocatable :: image(:, :), matrix(:, :)
      integer :: i, info, m, n

      m = size(space, 2)
      n = size(space, 1)/2
      allocate (image(2*n, m), value(m), small(m, m))
      do i = 1, m
         call self%apply(space(:, i), image(:, i))
      end do
      matrix = matmul(transpose(space), image)
      call right_eigen(matrix, value, info, small)
      found = info == 0
      if (.not. found) return
      associate (order => rising_order(-abs(value)))
         value = self%shift + 1/value(order)
         ! One of a pair may come before or after the other: equal distances keep their order.
         vector = matmul(space(:n, :), small(:, order))
      end associate
   end subroutine pairs_of

   !> The radius of a circle around `shift` in the widest gap of the eigenvalues, given by rising distance from it, with at least
   !> `least` of the values with Im >= 0 and all moduli up to `radius` inside, and how many are inside; 0 if there is no such gap.
   pure subroutine choose_circle(value, shift, least, radius, rho, inside)
      complex(wp), intent(in) :: value(:)
      real(wp), intent(in) :: shift, radius
      integer, intent(in) :: least
      real(wp), intent(out) :: rho
      integer, intent(out) :: inside

      real(wp) :: distance(size(value)), gap, widest
      integer :: i

      distance = abs(value - shift)
      rho = 0.0_wp
      inside = 0
      widest = copy
      do i = 1, size(value) - 1
         associate (between => 0.5_wp*(distance(i) + distance(i + 1)))
            gap = (distance(i + 1) - distance(i))/between
            if (gap < widest .or. between < radius + shift) cycle
            if (count(value(:i)%im >= 0.0_wp .and. abs(value(:i)) <= between - shift) < least) cycle
            widest = gap
            rho = between
            inside = i
         end associate
      end do
   end subroutine choose_circle

   !> The `place`-th smallest modulus of the values with Im >= 0.
   pure real(wp) function modulus_of(value, place)
      complex(wp), intent(in) :: value(:)
      integer, intent(in) :: place

      real(wp), allocatable :: modulus(:)

      modulus_of = 0.0_wp
      modulus = abs(pack(value, value%im >= 0.0_wp))
      modulus = modulus(rising_order(modulus))
      if (place > 0) modulus_of = modulus(place)
   end function modulus_of

   !> How many eigenvalues inside the circle around σ of radius `rho` are not among the first `inside` of `value`, which are those
   !> in it; the others of `value` are outside. A complex one has the other of its pair in the list.
   integer function count_missing(self, value, inside, rho) result(missing)
      class(disc_t), intent(in) :: self
      complex(wp), intent(in) :: value(:)
      integer, intent(in) :: inside
      real(wp), intent(in) :: rho

      type(sample_t) :: first, last
      real(wp) :: turned
      integer :: i

      if (self%gyroscopic) then
         missing = 2*(quadratic_inertia(self%stiffness, self%damping, self%mass, sqrt(rho**2 - self%shift**2)) &
                      - size(self%rigid, 2)) - inside
         return
      end if
      ! The other half of the circle is the mirror image of this one.
      turned = 0.0_wp
      first = sample_at(self, value, rho, 0.0_wp)
      do i = 1, arcs
         last = sample_at(self, value, rho, i*pi/arcs)
         call add_turn(self, value, rho, first, last, 0, turned)
         first = last
      end do
      missing = nint(turned/pi)
   end function count_missing

   !> Add how far h turns between two points of the circle.
   recursive subroutine add_turn(self, value, rho, first, last, depth, turned)
      class(disc_t), intent(in) :: self
      complex(wp), intent(in) :: value(:)
      real(wp), intent(in) :: rho
      type(sample_t), intent(in) :: first, last
      integer, intent(in) :: depth
      real(wp), intent(inout) :: turned

      type(sample_t) :: middle
      real(wp) :: arc, expected, rest

      arc = last%angle - first%angle
      expected = 0.5_wp*(first%rate + last%rate)*arc
      rest = angle_of(last%direction*conjg(first%direction)*cmplx(cos(expected), -sin(expected), wp))
      associate (centre => on_circle(self, rho, first%angle + 0.5_wp*arc))
         if (depth == most_halvings .or. (abs(rest) < off .and. abs(last%rate - first%rate)*arc < bend .and. &
                                          rho*arc < minval(abs(centre - value)))) then
            turned = turned + expected + rest
            return
         end if
      end associate
      middle = sample_at(self, value, rho, first%angle + 0.5_wp*arc)
      call add_turn(self, value, rho, first, middle, depth + 1, turned)
      call add_turn(self, value, rho, middle, last, depth + 1, turned)
   end subroutine add_turn

   pure function sample_at(self, value, rho, angle) result(sample)
      class(disc_t), intent(in) :: self
      complex(wp), intent(in) :: value(:)
      real(wp), intent(in) :: rho, angle
      type(sample_t) :: sample

      sample%angle = angle
      sample%direction = left_over(self, value, on_circle(self, rho, angle))
      sample%rate = angle_of(left_over(self, value, on_circle(self, rho, angle + short))*conjg(sample%direction))/short
   end function sample_at

   pure complex(wp) function on_circle(self, rho, angle)
      class(disc_t), intent(in) :: self
      real(wp), intent(in) :: rho, angle

      on_circle = self%shift + rho*cmplx(cos(angle), sin(angle), wp)
   end function on_circle

   !> h/|h|, with the eigenvalues of rigid motions divided out, too.
   pure complex(wp) function left_over(self, value, s) result(direction)
      class(disc_t), intent(in) :: self
      complex(wp), intent(in) :: value(:), s

      complex(wp) :: factor(size(self%mass%entry, 2))
      integer :: i

      factor = quadratic_pivots(self%stiffness, self%damping, self%mass, s)
      direction = (conjg(s)/abs(s))**(2*size(self%rigid, 2))
      do i = 1, size(factor)
         direction = direction*factor(i)/abs(factor(i))
      end do
      do i = 1, size(value)
         direction = direction*conjg(s - value(i))/abs(s - value(i))
      end do
   end function left_over

   pure real(wp) function angle_of(number)
      complex(wp), intent(in) :: number

      angle_of = atan2(number%im, number%re)
   end function angle_of

end module razy_eigen_disc
