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
!!
!! Motions among the η without stiffness, and those without damping too, are known from the directions of elements and contacts
!! (razy_machine_free_motions). They are the last columns of Q, and what K and B do to them is 0, not what rounding leaves of it.
module razy_exact_constrained_motion
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_constraints, only: constraints_t
   use razy_hybrid_linear_form, only: linear_form_t, new_form
   use razy_linalg_eigen, only: symmetric_eigen
   use razy_linalg_null_space, only: complement_of
   implicit none(type, external)
   private

   public :: constrained_motion_t, new_constrained_motion

   !> Coordinates (m) of a state with constraints (n, of rank r).
   type :: constrained_motion_t
      integer :: m = 0, n = 0, rank = 0
      !> The last of the η have no stiffness; of these the first `rigid` have no damping either.
      integer, private :: unsprung = 0, rigid = 0
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
      procedure :: unsprung_in_x
      procedure :: load_of
      procedure :: harmonic_of
      procedure :: form_of
      procedure :: reaction
      procedure :: to_coordinates
      procedure :: to_state
      procedure :: hold
      procedure :: numbers
   end type constrained_motion_t

   !> Modes of K_q below this part of the largest are slow; in all others a decoupling leaves no more than the rounding of K_q.
   real(wp), parameter :: slow = 1.0e-12_wp
   !> A coupling below this part of its terms is rounding.
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   !> The coordinates for `constraints` with the directions `w` (m, contacts) of all contacts and the coefficients `phi` of the
   !> friction that the constraints press; `k` and `b` (m, m) are those of motion without constraints, and become K_x and B_x;
   !> `drive` (n) are the speeds c, `free` (m, r) the motions without stiffness, the first `rigid` without damping, too.
   subroutine new_constrained_motion(self, constraints, w, phi, k, b, drive, free, rigid)
      type(constrained_motion_t), intent(out) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :), phi(:), drive(:), free(:, :)
      real(wp), intent(inout) :: k(:, :), b(:, :)
      integer, intent(in) :: rigid

      real(wp) :: d(size(w, 1), constraints%count), unit(constraints%count)
      integer :: i, m, n

      m = size(w, 1)
      n = constraints%count
      self%m = m
      self%n = n
      self%rank = constraints%rank
      self%unsprung = size(free, 2)
      self%rigid = rigid
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
      call find_bases(self, constraints, w(:, self%contact), free)
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

   !> Numbers that it holds, in the large arrays.
   elemental integer(i8) function numbers(self)
      class(constrained_motion_t), intent(in) :: self

      numbers = 0
      if (allocated(self%left)) numbers = 2*size(self%from_x, kind=i8) + 2*size(self%pull) + 3*size(self%left) + size(self%r) &
                                          + size(self%lambda) + size(self%settle) + 2*size(self%follow)
   end function numbers

   !> R, Q and S.
   subroutine find_bases(self, constraints, w, free)
      type(constrained_motion_t), intent(inout) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :), free(:, :)

      real(wp) :: square
      integer :: i

      allocate (self%r(self%m, self%rank), self%settle(self%rank, self%n))
      do i = 1, self%rank
         associate (v => constraints%range(:, i))
            square = dot_product(v, matmul(constraints%gram, v))
            self%r(:, i) = matmul(w, v)/sqrt(square)
            self%settle(i, :) = v/sqrt(square)
         end associate
      end do
      associate (known => reshape([self%r, free], [self%m, self%rank + self%unsprung]))
         self%q = reshape([complement_of(known), free], [self%m, self%m - self%rank])
      end associate
   end subroutine find_bases

   !> a, b and y0, or none of them; K_x and B_x from K and B.
   subroutine separate(self, k, b, drive)
      type(constrained_motion_t), intent(inout) :: self
      real(wp), intent(inout) :: k(:, :), b(:, :)
      real(wp), intent(in) :: drive(:)

      real(wp) :: kq(self%m - self%rank, self%m - self%rank), bq(self%m - self%rank, self%m - self%rank)
      real(wp), dimension(self%m - self%rank, self%rank) :: kr, br, lag
      real(wp) :: phi(self%m - self%rank, self%m - self%rank), square(self%m - self%rank)
      logical :: firm(self%m - self%rank), possible
      integer :: info

      associate (free => self%m - self%rank)
         allocate (self%follow(free, self%rank), self%drag(free, self%rank), source=0.0_wp)
         allocate (self%y0(self%m), source=0.0_wp)
         if (free == 0) then
            k = 0.0_wp
            b = 0.0_wp
            return
         end if
         call project(self, k, self%unsprung, kq, kr)
         call project(self, b, self%rigid, bq, br)
         self%drag = br
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
            self%drag = br
         end if
         k = 0.0_wp
         b = 0.0_wp
         b(:free, :free) = bq
         if (self%apart) then
            k(:free, :free) = 0.5_wp*(kq + transpose(kq))
         else
            k(:free, :free) = kq
            k(:free, free + 1:) = kr
            b(:free, free + 1:) = br
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

   !> Qᵀ P A Q and Qᵀ P A R. The first `still` of the last columns of Q are not felt by A; where A and P are symmetric, neither are
   !> their rows. Else what is rounding of its terms, or of Q and R, is nothing.
   subroutine project(self, a, still, on_free, on_held)
      type(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: a(:, :)
      integer, intent(in) :: still
      real(wp), intent(out) :: on_free(:, :), on_held(:, :)

      real(wp) :: product(size(self%left, 1), self%m), v(self%m, self%m)
      real(wp) :: by_left(size(self%left, 1)), by_v(self%m)

      associate (free => self%m - self%rank)
         v(:, :free) = self%q
         v(:, free + 1:) = self%r
         product = matmul(self%left, matmul(a, v))
         by_left = matmul(abs(self%left), sum(abs(a), dim=2))
         by_v = matmul(sum(abs(a), dim=1), abs(v))
         where (abs(product) <= 16*self%m*epsilon(1.0_wp)*(spread(by_left, 2, size(by_v)) + spread(by_v, 1, size(by_left)))) &
            product = 0.0_wp
         associate (first => free - self%unsprung + 1, last => free - self%unsprung + still)
            product(:, first:last) = 0.0_wp
            if (size(self%sliding) == 0 .and. all(abs(a - transpose(a)) <= rounding*maxval(abs(a)))) product(first:last, :) = 0.0_wp
         end associate
         on_free = product(:, :free)
         on_held = product(:, free + 1:)
      end associate
   end subroutine project

   !> The motions without stiffness in x (m, r), the first `rigid` without damping, too. The ξ are some of them where nothing
   !> couples them with the η.
   pure subroutine unsprung_in_x(self, shape, rigid)
      class(constrained_motion_t), intent(in) :: self
      real(wp), allocatable, intent(out) :: shape(:, :)
      integer, intent(out) :: rigid

      integer :: at(self%unsprung + self%rank), i, used

      associate (free => self%m - self%rank)
         used = merge(self%rank, 0, self%apart)
         rigid = used + self%rigid
         at(:used) = [(free + i, i=1, used)]
         at(used + 1:used + self%unsprung) = [(free - self%unsprung + i, i=1, self%unsprung)]
      end associate
      allocate (shape(self%m, used + self%unsprung), source=0.0_wp)
      do i = 1, size(shape, 2)
         shape(at(i), i) = 1.0_wp
      end do
   end subroutine unsprung_in_x

   !> The constant part of f_x (m) under the load (m).
   pure function load_of(self, load) result(in_x)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: load(:)
      real(wp) :: in_x(self%m)

      in_x = 0.0_wp
      in_x(:self%m - self%rank) = felt(self, load)
   end function load_of

   !> Qᵀ P f of a load f (m), without what is rounding of its terms, or of Q beside what of f is held.
   pure function felt(self, load)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(in) :: load(:)
      real(wp) :: felt(size(self%left, 1))

      felt = matmul(self%left, load)
      where (abs(felt) <= 16*self%m*epsilon(1.0_wp)*(matmul(abs(self%left), abs(load)) + norm2(matmul(load, self%r)))) felt = 0.0_wp
   end function felt

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
            in_x(:free, t) = cmplx(felt(self, harmonic(:, t)%re), felt(self, harmonic(:, t)%im), wp) &
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

      form = new_form(-matmul(self%pull(i, :), k), -matmul(self%pull(i, :), b), on(load), &
                      [(cmplx(on(harmonic(:, t)%re), on(harmonic(:, t)%im), wp) &
                        - omega(t)**2*sum(self%lambda(i, :)*error(:, t)), t=1, size(omega))])

   contains

      !> What of a load (m) the constraint feels, without what is rounding.
      pure real(wp) function on(load)
         real(wp), intent(in) :: load(:)

         on = dot_product(self%pull(i, :), load)
         if (abs(on) <= 16*self%m*epsilon(1.0_wp)*norm2(self%pull(i, :))*norm2(load)) on = 0.0_wp
      end function on

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

   !> Give the coordinates x (2m) the rates with which what is held moves by drives and errors, whose s' are `rate` (n).
   pure subroutine hold(self, x, rate)
      class(constrained_motion_t), intent(in) :: self
      real(wp), intent(inout) :: x(:)
      real(wp), intent(in) :: rate(:)

      if (self%n > 0) x(2*self%m - self%rank + 1:) = -matmul(self%settle, rate)
   end subroutine hold

end module razy_exact_constrained_motion
