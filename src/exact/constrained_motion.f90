!! Motion while contacts hold constraints (closed rigid stops, sticking friction), in coordinates in which it is free.
!!
!! With constraints w_cᵀ y'' + e_c'' = 0, their forces λ = Λ (Wᵀ a + e''), a the acceleration without them, and the directions D
!! in which these act (friction that slides under a rigid contact included), razy_hybrid_constraints,
!!
!!     y'' = P a - D Λ e'',   P = I - D Λ Wᵀ.
!!
!! R is an orthonormal basis of the range of W and Q of its complement. ξ = Rᵀ y is known: ξ = ξ0 + ν t - S e(t), S the inverse of
!! Wᵀ R, with the constant rate ν = -S c of sticking contacts that are driven with the speed c (a belt). The rest, η = Qᵀ y,
!! obeys η'' + B_q η' + K_q η + K_r ξ + B_r ξ' = f_q with K_q = Qᵀ P K Q, K_r = Qᵀ P K R and so on. With K_q a = -K_r and
!! K_q b = -(B_q a + B_r) the coordinates x = (η - a ξ - b ν, ξ) are not coupled any more:
!!
!!     y = T x + y0,   T = (Q, R + Q a),   y0 = Q b ν,
!!
!! and x'' + B_x x' + K_x x = f_x is an equation like that of free motion, in which the ξ are rigid modes. Where K_q is not
!! symmetric or has slow modes that ξ moves, a = b = 0 and the coupling stays in K_x and B_x, which are then not symmetric.
module razy_exact_constrained_motion
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t
   use razy_hybrid_linear_form, only: linear_form_t, new_form
   use razy_linalg_eigen, only: symmetric_eigen
   implicit none(type, external)
   private

   public :: constrained_motion_t, new_constrained_motion

   !> Coordinates (m) of a state with constraints (n, of rank r).
   type :: constrained_motion_t
      integer :: m = 0, n = 0, rank = 0
      !> Whether constraint forces exist.
      logical :: found = .true.
      !> Whether a and b are used.
      logical, private :: apart = .true.
      !> Numbers of the contacts that hold (n); friction that slides under one of them: its contact, the row of the constraint, and
      !> its force in parts of that of the constraint.
      integer, allocatable :: contact(:), sliding(:), row(:)
      real(wp), allocatable :: share(:)
      !> T and its inverse (m, m), y0 (m).
      real(wp), allocatable :: from_x(:, :), to_x(:, :)
      real(wp), allocatable, private :: y0(:)
      !> Λ (n, n), Λ Wᵀ (n, m), D Λ (m, n), S (r, n), Q (m, m - r), R (m, r), Qᵀ P (m - r, m).
      real(wp), allocatable, private :: lambda(:, :), pull(:, :), push(:, :), settle(:, :), q(:, :), r(:, :), left(:, :)
      !> a (m - r, r), and B_q a + B_r (m - r, r).
      real(wp), allocatable, private :: follow(:, :), drag(:, :)
   contains
      procedure :: projected
      procedure :: transform_matrices
      procedure :: load_of
      procedure :: harmonic_of
      procedure :: form_of
      procedure :: reaction
      procedure :: to_coordinates
      procedure :: to_state
   end type constrained_motion_t

   !> Modes of K_q below this part of the largest are slow; in all others a decoupling leaves no more than the rounding of K_q.
   real(wp), parameter :: slow = 1.0e-12_wp
   !> A coupling below this part of its terms is rounding.
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   !> The coordinates for `constraints` with the directions `w` (m, contacts) of all contacts and the coefficients `phi` of the
   !> friction that the constraints press; `k` and `b` (m, m) are those of motion without constraints, `drive` (n) the speeds c.
   subroutine new_constrained_motion(self, constraints, w, phi, k, b, drive)
      type(constrained_motion_t), intent(out) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :), phi(:), k(:, :), b(:, :), drive(:)

      real(wp) :: d(size(w, 1), constraints%count), unit(constraints%count)
      integer :: i, m, n

      m = size(w, 1)
      n = constraints%count
      self%m = m
      self%n = n
      self%rank = constraints%rank
      self%contact = constraints%contact(:n)
      self%sliding = constraints%sliding(:constraints%couplings)
      self%row = constraints%row(:constraints%couplings)
      self%share = constraints%sign(:constraints%couplings)*phi
      d = w(:, self%contact)
      do i = 1, constraints%couplings
         d(:, constraints%row(i)) = d(:, constraints%row(i)) + constraints%sign(i)*phi(i)*w(:, constraints%sliding(i))
      end do
      allocate (self%lambda(n, n), self%from_x(m, m), self%to_x(m, m))
      do i = 1, n
         unit = 0.0_wp
         unit(i) = 1.0_wp
         call constraints%solve(unit, phi, self%lambda(:, i), self%found)
         if (.not. self%found) return
      end do
      self%pull = matmul(self%lambda, transpose(w(:, self%contact)))
      self%push = matmul(d, self%lambda)
      call find_bases(self, constraints, w(:, self%contact))
      self%left = transpose(self%q)
      if (constraints%couplings > 0) self%left = self%left - matmul(matmul(self%left, self%push), transpose(w(:, self%contact)))
      call separate(self, k, b, drive)
      associate (free => m - self%rank)
         self%from_x(:, :free) = self%q
         self%from_x(:, free + 1:) = self%r + matmul(self%q, self%follow)
         self%to_x(:free, :) = transpose(self%q) - matmul(self%follow, transpose(self%r))
         self%to_x(free + 1:, :) = transpose(self%r)
      end associate
   end subroutine new_constrained_motion

   !> R, Q and S; Q are the last columns of Householder's reflections that take R to the first unit vectors.
   subroutine find_bases(self, constraints, w)
      type(constrained_motion_t), intent(inout) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :)

      real(wp) :: mirror(self%m, self%rank), rest(self%m, self%rank), square, twice(self%rank)
      integer :: i, j

      allocate (self%r(self%m, self%rank), self%q(self%m, self%m - self%rank), self%settle(self%rank, self%n))
      do i = 1, self%rank
         associate (v => constraints%range(:, i))
            square = dot_product(v, matmul(constraints%gram, v))
            self%r(:, i) = matmul(w, v)/sqrt(square)
            self%settle(i, :) = v/sqrt(square)
         end associate
      end do
      rest = self%r
      mirror = 0.0_wp
      do i = 1, self%rank
         mirror(i:, i) = rest(i:, i)
         mirror(i, i) = mirror(i, i) + sign(norm2(rest(i:, i)), rest(i, i))
         ! Not normalised, so that unit vectors stay what they are.
         twice(i) = 2/dot_product(mirror(:, i), mirror(:, i))
         do j = i, self%rank
            rest(:, j) = rest(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), rest(:, j)))
         end do
      end do
      self%q = 0.0_wp
      do j = 1, self%m - self%rank
         self%q(self%rank + j, j) = 1.0_wp
         do i = self%rank, 1, -1
            self%q(:, j) = self%q(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), self%q(:, j)))
         end do
      end do
   end subroutine find_bases

   !> a, b and y0, or none of them.
   subroutine separate(self, k, b, drive)
      type(constrained_motion_t), intent(inout) :: self
      real(wp), intent(in) :: k(:, :), b(:, :), drive(:)

      real(wp) :: kq(self%m - self%rank, self%m - self%rank), bq(self%m - self%rank, self%m - self%rank)
      real(wp) :: kr(self%m - self%rank, self%rank), lag(self%m - self%rank, self%rank)
      real(wp) :: phi(self%m - self%rank, self%m - self%rank), square(self%m - self%rank)
      logical :: firm(self%m - self%rank), possible
      integer :: info

      associate (free => self%m - self%rank)
         allocate (self%follow(free, self%rank), self%drag(free, self%rank), source=0.0_wp)
         allocate (self%y0(self%m), source=0.0_wp)
         if (free == 0) return
         kq = self%projected(k, self%q)
         bq = self%projected(b, self%q)
         kr = self%projected(k, self%r)
         self%drag = self%projected(b, self%r)
         lag = 0.0_wp
         self%apart = all(abs(kq - transpose(kq)) <= rounding*maxval(abs(kq)))
         if (self%apart) then
            phi = kq
            call symmetric_eigen(phi, square, info)
            self%apart = info == 0
            firm = abs(square) > slow*maxval(abs(square))
         end if
         if (self%apart) then
            call divide(kr, maxval(abs(k)), self%follow, possible)
            self%apart = possible
            self%drag = self%drag + matmul(bq, self%follow)
            call divide(self%drag, maxval(abs(b))*(1.0_wp + maxval(abs(self%follow))), lag, possible)
            self%apart = self%apart .and. possible
         end if
         if (self%apart) then
            self%y0 = -matmul(self%q, matmul(lag, matmul(self%settle, drive)))
         else
            self%follow = 0.0_wp
            self%drag = self%projected(b, self%r)
         end if
      end associate

   contains

      !> x with K_q x = -right in firm modes; not possible if `right`, a sum of terms of `size_of`, moves others.
      subroutine divide(right, size_of, x, possible)
         real(wp), intent(in) :: right(:, :), size_of
         real(wp), intent(out) :: x(:, :)
         logical, intent(out) :: possible

         real(wp) :: modal(size(right, 1), size(right, 2))
         integer :: i

         modal = matmul(transpose(phi), right)
         possible = .true.
         do i = 1, size(square)
            if (firm(i)) then
               modal(i, :) = -modal(i, :)/square(i)
            else
               possible = possible .and. all(abs(modal(i, :)) <= rounding*size_of)
               modal(i, :) = 0.0_wp
            end if
         end do
         x = matmul(phi, modal)
      end subroutine divide

   end subroutine separate

   !> Qᵀ P A V. What is rounding of its terms, or of Q and V, is nothing: the stiffness between bodies that are held together is
   !> none of the free motion, which would have a slow mode else where it has a rigid one.
   pure function projected(self, a, v) result(product)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: a(:, :), v(:, :)
      real(wp) :: product(size(self%left, 1), size(v, 2))

      real(wp) :: by_left(size(self%left, 1)), by_v(size(v, 2))

      product = matmul(self%left, matmul(a, v))
      by_left = sum(matmul(abs(self%left), abs(a)), dim=2)
      by_v = sum(matmul(abs(a), abs(v)), dim=1)
      where (abs(product) <= 16*self%m*epsilon(1.0_wp)*(spread(by_left, 2, size(by_v)) + spread(by_v, 1, size(by_left)))) &
         product = 0.0_wp
   end function projected

   !> K_x and B_x (m, m) from K and B.
   subroutine transform_matrices(self, k, b)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(inout) :: k(:, :), b(:, :)

      real(wp) :: kx(self%m, self%m), bx(self%m, self%m)

      kx = 0.0_wp
      bx = 0.0_wp
      associate (free => self%m - self%rank)
         kx(:free, :free) = self%projected(k, self%q)
         bx(:free, :free) = self%projected(b, self%q)
         if (self%apart) then
            kx = 0.5_wp*(kx + transpose(kx))
         else
            kx(:free, free + 1:) = self%projected(k, self%r)
            bx(:free, free + 1:) = self%drag
         end if
      end associate
      k = kx
      b = bx
   end subroutine transform_matrices

   !> The constant part of f_x (m) under the load (m).
   pure function load_of(self, load) result(in_x)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: load(:)
      real(wp) :: in_x(self%m)

      in_x = 0.0_wp
      in_x(:self%m - self%rank) = matmul(self%left, load)
   end function load_of

   !> Phasors of f_x (m, tones) under the loads `harmonic` (m, tones) and the errors (n, tones) of the constraints.
   pure function harmonic_of(self, harmonic, error, omega) result(in_x)
      class(constrained_motion_t), intent(in) :: self
      complex(wp), intent(in) :: harmonic(:, :), error(:, :)
      real(wp), intent(in) :: omega(:)
      complex(wp) :: in_x(self%m, size(omega))

      complex(wp) :: along(self%rank)
      integer :: t

      associate (free => self%m - self%rank)
         do t = 1, size(omega)
            along = matmul(self%settle, error(:, t))
            in_x(:free, t) = matmul(self%left, harmonic(:, t)) &
                             + omega(t)**2*(matmul(matmul(self%push, error(:, t)), self%q) - matmul(self%follow, along))
            if (self%apart) in_x(:free, t) = in_x(:free, t) + cmplx(0.0_wp, omega(t), wp)*matmul(self%drag, along)
            in_x(free + 1:, t) = omega(t)**2*along
         end do
      end associate
   end function harmonic_of

   !> A form on y as one on x, which it is where nothing is held.
   pure function form_of(self, form) result(in_x)
      class(constrained_motion_t), intent(in) :: self
      type(linear_form_t), intent(in) :: form
      type(linear_form_t) :: in_x

      if (self%n == 0) then
         in_x = form
         return
      end if
      in_x = new_form(matmul(form%on_y, self%from_x), matmul(form%on_v, self%from_x), &
                      form%constant + dot_product(form%on_y, self%y0), form%error)
   end function form_of

   !> The force of constraint i as a form on y, from K, B, load and phasors without constraints, and the errors (n, tones).
   pure function reaction(self, i, k, b, load, harmonic, error, omega) result(form)
      class(constrained_motion_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: k(:, :), b(:, :), load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :), error(:, :)
      type(linear_form_t) :: form

      integer :: t

      form = new_form(-matmul(self%pull(i, :), k), -matmul(self%pull(i, :), b), dot_product(self%pull(i, :), load), &
                      [(sum(self%pull(i, :)*harmonic(:, t)) - omega(t)**2*sum(self%lambda(i, :)*error(:, t)), t=1, size(omega))])
   end function reaction

   !> Coordinates x and rates (2m) of the state z = (y, y').
   pure function to_coordinates(self, z) result(x)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp) :: x(size(z))

      x(:self%m) = matmul(self%to_x, z(:self%m) - self%y0)
      x(self%m + 1:) = matmul(self%to_x, z(self%m + 1:))
   end function to_coordinates

   !> The state (y, y') of coordinates x and their rates (2m).
   pure function to_state(self, x) result(z)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp) :: z(size(x))

      z(:self%m) = self%y0 + matmul(self%from_x, x(:self%m))
      z(self%m + 1:) = matmul(self%from_x, x(self%m + 1:))
   end function to_state

end module razy_exact_constrained_motion
