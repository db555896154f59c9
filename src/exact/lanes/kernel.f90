!! The next smooth piece of motions side by side: its first exit, with proof that none was before, and the state there.
!!
!! Along a stretch of a mode every guard is a Taylor polynomial and a remainder that the moduli of the amplitudes bound. From a
!! point where it is positive it stays so for the step that its value, slope and curvature there and a bound of its third
!! derivative allow; such steps come to its first root from the left and never pass one. A guard that starts on its bound is
!! divided by the time. The root is then polished on the closed form, from the start of the piece.
!!
!! What is near rounding, grazes, or leaves with others is not decided here: `left` is 0 then, and the search for one motion
!! (razy_exact_search_search) does it. Every operation is that of one lane, in the same order whatever its neighbours do.
module razy_exact_lanes_kernel
   use, intrinsic :: iso_fortran_env, only: int64
   use razy_core_kinds, only: wp
   use razy_exact_lanes_block, only: block_t, lanes
   use razy_exact_lanes_gates, only: gate_t, lane_mode_t, order
   implicit none(type, external)
   private

   public :: evaluate, first_root, follow_pieces, grow_by, turn_by

   !> Stretches of a piece, and steps towards a root on one, before the motion is left to the other search.
   integer, parameter :: most_stretches = 64, most_steps = 16
   !> What `first_root` says where there is no root, and where it cannot tell.
   real(wp), parameter :: none = 2.0_wp, unknown = -1.0_wp
   !> A step so short, in stretches, has come to the root but for what polishing does.
   real(wp), parameter :: short = 1.0e-4_wp
   !> In stretches, a correction after which terms of fourth order are below rounding.
   real(wp), parameter :: most_polished = 5.0e-5_wp
   !> A guard that is a larger part of what its terms could be is certainly no rounding.
   real(wp), parameter :: small = 1.0e-10_wp
   !> Added to a number below 2^51 and taken away, it rounds it to an integer, whose bits are then the last ones of the sum.
   real(wp), parameter :: shift = 6755399441055744.0_wp

contains

   !> Follow a piece in each lane through `gate` and along `mode`.
   subroutine follow_pieces(mode, gate, b)
      type(lane_mode_t), intent(in) :: mode
      type(gate_t), intent(in) :: gate
      type(block_t), intent(inout) :: b

      real(wp) :: at(lanes, mode%rows), bounds(lanes, 3), cosine(lanes, mode%tones), sine(lanes, mode%tones)
      real(wp) :: powers(lanes, order, mode%tones)
      real(wp), dimension(lanes) :: left, active, root, tau
      real(wp) :: hit
      integer :: i, l

      call pass(mode%rows, gate%before, 2*mode%tones + 1, mode%tones, gate%matrix, b%state, b%through, b%cosine, b%sine, b%start)
      at = b%start(:, :mode%rows)
      cosine = b%cosine(:, :mode%tones)
      sine = b%sine(:, :mode%tones)
      call find_powers(mode, b%tone, powers)
      call bound_derivatives(mode, b%own, powers, at, bounds)
      active = 1.0_wp
      tau = 0.0_wp
      b%left = 0.0_wp
      b%tau = 0.0_wp
      b%stretches = 0.0_wp
      do i = 1, most_stretches
         call find_exit(mode, merge(gate%zero, 0, i == 1), b%own, powers, bounds, at, cosine, sine, i == 1, active, root, left)
         !$omp simd private(hit)
         do l = 1, lanes
            hit = active(l)*is_positive(root(l) - 0.5_wp*unknown)*is_positive(0.5_wp*(1.0_wp + none) - root(l))
            b%stretches(l) = b%stretches(l) + active(l)
            b%tau(l) = b%tau(l) + hit*(tau(l) + root(l)*mode%step)
            b%left(l) = b%left(l) + hit*left(l)
            active(l) = active(l)*is_positive(root(l) - 0.5_wp*(1.0_wp + none))*is_positive(b%rest(l) - tau(l))
            tau(l) = tau(l) + mode%step
         end do
         if (.not. any(active > 0.5_wp)) exit
         call go_on(mode, b%own, at, cosine, sine)
      end do
      call arrive(mode, b)
   end subroutine follow_pieces

   !> Amplitudes at the start of a piece from those at the end of the piece before, the tones and the constant 1.
   pure subroutine pass(rows, before, extra, tones, matrix, state, through, cosine, sine, start)
      integer, intent(in) :: rows, before, extra, tones
      real(wp), intent(in) :: matrix(rows, before), state(lanes, before), through(lanes, rows, extra)
      real(wp), intent(in) :: cosine(lanes, tones), sine(lanes, tones)
      real(wp), intent(inout) :: start(lanes, rows)

      real(wp) :: total(lanes)
      integer :: c, l, r, t

      do r = 1, rows
         total = through(:, r, extra)
         do t = 1, tones
            !$omp simd
            do l = 1, lanes
               total(l) = total(l) + (through(l, r, 2*t - 1)*cosine(l, t) + through(l, r, 2*t)*sine(l, t))
            end do
         end do
         do c = 1, before
            !$omp simd
            do l = 1, lanes
               total(l) = total(l) + matrix(r, c)*state(l, c)
            end do
         end do
         start(:, r) = total
      end do
   end subroutine pass

   !> angle^p/p! of each tone over a stretch: odd and even ones each from the one before.
   pure subroutine find_powers(mode, tone, powers)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: tone(lanes, mode%tones)
      real(wp), intent(out) :: powers(lanes, order, mode%tones)

      real(wp), dimension(lanes) :: even, odd, square
      integer :: l, p, t
      real(wp), parameter :: part(3:order) = [(1.0_wp/(p*(p - 1)), p=3, order)]

      do t = 1, mode%tones
         odd = tone(:, t)*mode%step
         square = odd*odd
         even = 0.5_wp*square
         powers(:, 1, t) = odd
         powers(:, 2, t) = even
         do p = 3, order, 2
            !$omp simd
            do l = 1, lanes
               odd(l) = odd(l)*(square(l)*part(p))
               even(l) = even(l)*(square(l)*part(p + 1))
               powers(l, p, t) = odd(l)
               powers(l, p + 1, t) = even(l)
            end do
         end do
      end do
   end subroutine find_powers

   !> Bounds of the form from the start of a piece on, which nothing grows in: of what its Taylor polynomials leave out, and of its
   !> third and fourth derivative by the time in stretches.
   pure subroutine bound_derivatives(mode, own, powers, at, bounds)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers), powers(lanes, order, mode%tones), at(lanes, mode%rows)
      real(wp), intent(out) :: bounds(lanes, 3)

      real(wp) :: angle, modulus, row
      integer :: k, l, t

      bounds = 0.0_wp
      do k = 1, mode%terms
         !$omp simd private(modulus)
         do l = 1, lanes
            modulus = sqrt(at(l, k)**2 + at(l, mode%terms + k)**2)
            bounds(l, 1) = bounds(l, 1) + mode%bounds_by(k, 1)*modulus
            bounds(l, 2) = bounds(l, 2) + mode%bounds_by(k, 2)*modulus
            bounds(l, 3) = bounds(l, 3) + mode%bounds_by(k, 3)*modulus
         end do
      end do
      do t = 1, mode%tones
         !$omp simd private(angle, row)
         do l = 1, lanes
            angle = powers(l, 1, t)
            row = abs(own(l, mode%waves + 2*t - 1)) + abs(own(l, mode%waves + 2*t))
            bounds(l, 1) = bounds(l, 1) + row*powers(l, order, t)*angle*(1.0_wp/(order + 1))
            bounds(l, 2) = bounds(l, 2) + row*angle**3
            bounds(l, 3) = bounds(l, 3) + row*angle**4
         end do
      end do
   end subroutine bound_derivatives

   !> The first root of any guard on a stretch, in stretches, and whose it is. `zero` starts on its bound; `first`: guards that
   !> start near theirs, whatever they do, cannot be told.
   subroutine find_exit(mode, zero, own, powers, bounds, at, cosine, sine, first, active, root, left)
      type(lane_mode_t), intent(in) :: mode
      integer, intent(in) :: zero
      real(wp), intent(in) :: own(lanes, mode%numbers), powers(lanes, order, mode%tones), bounds(lanes, 3)
      real(wp), intent(in) :: at(lanes, mode%rows), cosine(lanes, mode%tones), sine(lanes, mode%tones)
      logical, intent(in) :: first
      real(wp), intent(in) :: active(lanes)
      real(wp), intent(out) :: root(lanes), left(lanes)

      real(wp) :: a(lanes, 0:order), c(lanes, 0:order), bound(lanes), margin(lanes), other(lanes), third(lanes)
      real(wp) :: later
      integer :: g, l, p

      later = merge(0.0_wp, 1.0_wp, first)
      root = none
      left = 0.0_wp
      call series_of(mode, own, powers, at, cosine, sine, c)
      margin = margin_of(mode, own, at)
      do g = 1, mode%guards
         if (g == zero) then
            do p = 1, order
               !$omp simd
               do l = 1, lanes
                  a(l, p - 1) = mode%side(g)*c(l, p)
               end do
            end do
            a(:, order) = 0.0_wp
            ! Of f(s)/s, the mean of the derivative from 0 to s.
            third = 0.25_wp*bounds(:, 3)
         else
            bound = own(:, mode%bounds + g)
            do p = 0, order
               !$omp simd
               do l = 1, lanes
                  a(l, p) = mode%side(g)*c(l, p)
               end do
            end do
            a(:, 0) = mode%side(g)*(c(:, 0) - bound)
            third = bounds(:, 2)
         end if
         call first_root(a, bounds(:, 1), third, active, other)
         !$omp simd
         do l = 1, lanes
            other(l) = unknown + max(later, is_positive(a(l, 0) - margin(l)))*(other(l) - unknown)
            left(l) = left(l) + is_positive(root(l) - other(l))*(g - left(l))
            root(l) = min(root(l), other(l))
         end do
      end do
   end subroutine find_exit

   !> Taylor coefficients of the form over a stretch.
   pure subroutine series_of(mode, own, powers, at, cosine, sine, c)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers), powers(lanes, order, mode%tones)
      real(wp), intent(in) :: at(lanes, mode%rows), cosine(lanes, mode%tones), sine(lanes, mode%tones)
      real(wp), intent(out) :: c(lanes, 0:order)

      real(wp), dimension(lanes) :: even, odd
      integer :: k, l, n, p, t

      n = mode%terms
      c = 0.0_wp
      do k = 1, 2*n
         do p = 0, order
            !$omp simd
            do l = 1, lanes
               c(l, p) = c(l, p) + mode%series(p, k)*at(l, k)
            end do
         end do
      end do
      do t = 1, mode%tones
         !$omp simd
         do l = 1, lanes
            even(l) = own(l, mode%waves + 2*t - 1)*cosine(l, t) + own(l, mode%waves + 2*t)*sine(l, t)
            odd(l) = own(l, mode%waves + 2*t)*cosine(l, t) - own(l, mode%waves + 2*t - 1)*sine(l, t)
            c(l, 0) = c(l, 0) + even(l)
         end do
         do p = 1, order, 4
            !$omp simd
            do l = 1, lanes
               c(l, p) = c(l, p) + odd(l)*powers(l, p, t)
               c(l, p + 1) = c(l, p + 1) - even(l)*powers(l, p + 1, t)
               c(l, p + 2) = c(l, p + 2) - odd(l)*powers(l, p + 2, t)
               c(l, p + 3) = c(l, p + 3) + even(l)*powers(l, p + 3, t)
            end do
         end do
      end do
      c(:, 0) = c(:, 0) + own(:, mode%constant)
      associate (h => mode%step, r => mode%rigid)
         do k = 1, r
            !$omp simd
            do l = 1, lanes
               c(l, 0) = c(l, 0) + (mode%rigid_y(k)*at(l, 2*n + k) + mode%rigid_v(k)*at(l, 2*n + r + k))
               c(l, 1) = c(l, 1) + h*(mode%rigid_y(k)*at(l, 2*n + r + k) + mode%rigid_v(k)*own(l, mode%forces + k))
               c(l, 2) = c(l, 2) + 0.5_wp*h**2*mode%rigid_y(k)*own(l, mode%forces + k)
            end do
         end do
      end associate
   end subroutine series_of

   !> What of the form may be rounding, amply.
   pure function margin_of(mode, own, at) result(margin)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers), at(lanes, mode%rows)
      real(wp) :: margin(lanes)

      real(wp) :: motion(lanes)
      integer :: k, l

      motion = 0.0_wp
      do k = 1, 2*mode%terms
         motion = motion + abs(at(:, k))
      end do
      !$omp simd
      do l = 1, lanes
         margin(l) = own(l, mode%size) + own(l, mode%reach)*motion(l)
      end do
      do k = 1, mode%rigid
         margin = margin + (abs(mode%rigid_y(k)*at(:, 2*mode%terms + k)) &
                            + abs(mode%rigid_v(k)*at(:, 2*mode%terms + mode%rigid + k)))
      end do
      margin = small*margin
   end function margin_of

   !> The first root in [0, 1] of f(s) = Σ a_p s^p + a remainder of at most `rest`, of lanes that are `active`; near a root it ends
   !> left of it.
   !>
   !> With a third derivative of at least -m3, f(s + x) >= f + g x + (d - m3 r/3) x²/2 for x <= r: up to the root of that there is
   !> none of f.
   pure subroutine first_root(a, rest, m3, active, root)
      real(wp), intent(in) :: a(lanes, 0:order), rest(lanes), m3(lanes), active(lanes)
      real(wp), intent(out) :: root(lanes)

      real(wp), dimension(lanes) :: arrived, d, f, g, s, todo
      real(wp) :: bend, gap, last, reach, stays, step, there
      integer :: i, l

      !$omp simd private(bend, stays, there)
      do l = 1, lanes
         f(l) = a(l, 0) - rest(l)
         g(l) = a(l, 1)
         d(l) = 2*a(l, 2)
         s(l) = 0.0_wp
         bend = max(m3(l)*(1.0_wp/3) - d(l), 0.0_wp)
         stays = is_positive(min(f(l), f(l) + g(l) - 0.5_wp*bend))
         there = 1.0_wp - is_positive(f(l))
         todo(l) = active(l)*(1.0_wp - stays)
         ! It has none where it stays; is there, if it falls.
         root(l) = none + todo(l)*((unknown - none) - there*is_positive(-g(l))*unknown)
         todo(l) = todo(l)*(1.0_wp - there)
      end do
      do i = 1, most_steps
         if (.not. any(todo > 0.5_wp)) return
         !$omp simd private(bend, gap, last, reach, stays, step)
         do l = 1, lanes
            gap = 1.0_wp - s(l)
            bend = max(m3(l)*gap*(1.0_wp/3) - d(l), 0.0_wp)
            stays = todo(l)*is_positive(f(l) + gap*(g(l) - 0.5_wp*bend*gap))
            root(l) = root(l) + stays*(none - root(l))
            todo(l) = todo(l) - stays
            last = max(f(l), tiny(gap))
            ! Any reach is right; this one is far enough for the step near a root, and all that is left elsewhere.
            reach = min(gap, 2*last/max(-g(l), last))
            bend = max(m3(l)*reach*(1.0_wp/3) - d(l), 0.0_wp)
            step = min(reach, 2*last/max(sqrt(g(l)*g(l) + 2*bend*last) - g(l), last))
            s(l) = s(l) + step
            arrived(l) = is_positive(short - step)
         end do
         call evaluate(a, s, f, g, d)
         !$omp simd private(last)
         do l = 1, lanes
            f(l) = f(l) - rest(l)
            last = todo(l)*max(arrived(l), 1.0_wp - is_positive(f(l)))
            root(l) = root(l) + last*is_positive(-g(l))*(s(l) - root(l))
            todo(l) = todo(l) - last
         end do
      end do
   end subroutine first_root

   !> Value, slope and curvature of Σ a_p s^p, from its even and its odd part: chains of half the length.
   pure subroutine evaluate(a, s, f, g, d)
      real(wp), intent(in) :: a(lanes, 0:order), s(lanes)
      real(wp), intent(out) :: f(lanes), g(lanes), d(lanes)

      real(wp), dimension(lanes) :: even, even_d, even_g, odd, odd_d, odd_g, square
      integer :: l, p

      square = s*s
      even = a(:, order)
      odd = 0.0_wp
      even_g = 0.0_wp
      even_d = 0.0_wp
      odd_g = 0.0_wp
      odd_d = 0.0_wp
      do p = order - 2, 0, -2
         !$omp simd
         do l = 1, lanes
            odd_d(l) = odd_d(l)*square(l) + odd_g(l)
            odd_g(l) = odd_g(l)*square(l) + odd(l)
            odd(l) = odd(l)*square(l) + a(l, p + 1)
            even_d(l) = even_d(l)*square(l) + even_g(l)
            even_g(l) = even_g(l)*square(l) + even(l)
            even(l) = even(l)*square(l) + a(l, p)
         end do
      end do
      f = even + s*odd
      g = odd + 2*s*(even_g + s*odd_g)
      d = 2*even_g + s*(6*odd_g + 8*s*(even_d + s*odd_d))
   end subroutine evaluate

   !> 1 if x > 0, else 0: a factor in place of a branch.
   elemental real(wp) function is_positive(x)
      real(wp), intent(in) :: x

      is_positive = merge(1.0_wp, 0.0_wp, x > 0.0_wp)
   end function is_positive

   !> Go on by a stretch.
   pure subroutine go_on(mode, own, at, cosine, sine)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers)
      real(wp), intent(inout) :: at(lanes, mode%rows), cosine(lanes, mode%tones), sine(lanes, mode%tones)

      real(wp) :: re, tau(lanes)
      integer :: k, l, n, t

      n = mode%terms
      do k = 1, n
         !$omp simd private(re)
         do l = 1, lanes
            re = at(l, k)*mode%grown(k) - at(l, n + k)*mode%grown(n + k)
            at(l, n + k) = at(l, k)*mode%grown(n + k) + at(l, n + k)*mode%grown(k)
            at(l, k) = re
         end do
      end do
      do t = 1, mode%tones
         associate (c => own(:, mode%turns + 2*t - 1), s => own(:, mode%turns + 2*t))
            !$omp simd private(re)
            do l = 1, lanes
               re = cosine(l, t)*c(l) - sine(l, t)*s(l)
               sine(l, t) = cosine(l, t)*s(l) + sine(l, t)*c(l)
               cosine(l, t) = re
            end do
         end associate
      end do
      tau = mode%step
      call move_rigid(mode, own, tau, at)
   end subroutine go_on

   !> Move rigid modes by `tau`, s.
   pure subroutine move_rigid(mode, own, tau, at)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers), tau(lanes)
      real(wp), intent(inout) :: at(lanes, mode%rows)

      integer :: k, l, q

      do k = 1, mode%rigid
         q = 2*mode%terms + k
         !$omp simd
         do l = 1, lanes
            at(l, q) = at(l, q) + tau(l)*(at(l, q + mode%rigid) + 0.5_wp*tau(l)*own(l, mode%forces + k))
            at(l, q + mode%rigid) = at(l, q + mode%rigid) + tau(l)*own(l, mode%forces + k)
         end do
      end do
   end subroutine move_rigid

   !> The end of the piece from its start: the root of the guard that was left, polished, and the state there.
   subroutine arrive(mode, b)
      type(lane_mode_t), intent(in) :: mode
      type(block_t), intent(inout) :: b

      real(wp), dimension(lanes) :: cosine, d, decay, delta, f, good, margin, sine, slope
      real(wp) :: square
      integer :: k, l, n, t

      n = mode%terms
      do k = 1, n
         call turn_by(mode%turn(k)*b%tau, cosine, sine)
         call grow_by(mode%decay(k)*b%tau, decay)
         !$omp simd
         do l = 1, lanes
            cosine(l) = decay(l)*cosine(l)
            sine(l) = decay(l)*sine(l)
            b%state(l, k) = b%start(l, k)*cosine(l) - b%start(l, n + k)*sine(l)
            b%state(l, n + k) = b%start(l, k)*sine(l) + b%start(l, n + k)*cosine(l)
         end do
      end do
      b%state(:, 2*n + 1:mode%rows) = b%start(:, 2*n + 1:mode%rows)
      call move_rigid(mode, b%own, b%tau, b%state)
      call add_times(b%time, b%time_low, b%tau)
      do t = 1, mode%tones
         call turn_tone(b%tone(:, mode%tones + 4*t - 3:mode%tones + 4*t), b%time, b%time_low, b%cosine(:, t), b%sine(:, t))
      end do
      good = is_positive(b%left)
      call look_at_guards(mode, b, good, f, slope, d, margin)
      !$omp simd private(square)
      do l = 1, lanes
         square = slope(l)*slope(l) - 2*f(l)*d(l)
         good(l) = good(l)*is_positive(square)*is_positive(-slope(l)*mode%step - margin(l))
         ! Cauchy's correction, of third order.
         delta(l) = good(l)*(2*f(l)/(sqrt(abs(square)) + abs(slope(l)) + tiny(square)))
         good(l) = good(l)*is_positive(most_polished*mode%step - abs(delta(l)))*is_positive(b%tau(l) + delta(l)) &
                   *is_positive(b%rest(l) - (b%tau(l) + delta(l)))
         delta(l) = good(l)*delta(l)
      end do
      call polish(mode, b, delta)
      b%left = good*b%left
   end subroutine arrive

   !> Value, slope and curvature of the guard that is left in each lane, and what of it may be rounding; where another is not
   !> clear of its bound the lane is no `good`.
   subroutine look_at_guards(mode, b, good, f, slope, d, margin)
      type(lane_mode_t), intent(in) :: mode
      type(block_t), intent(in) :: b
      real(wp), intent(inout) :: good(lanes)
      real(wp), dimension(lanes), intent(out) :: f, slope, d, margin

      real(wp), dimension(lanes) :: first, second, value
      real(wp) :: own, side, this
      integer :: g, l

      f = 0.0_wp
      slope = 0.0_wp
      d = 0.0_wp
      call derivatives(mode, b%own, b%tone, b%state, b%cosine, b%sine, value, first, second)
      margin = margin_of(mode, b%own, b%state)
      do g = 1, mode%guards
         side = mode%side(g)
         !$omp simd private(own, this)
         do l = 1, lanes
            own = side*(value(l) - b%own(l, mode%bounds + g))
            this = is_positive(0.5_wp - abs(b%left(l) - g))
            good(l) = good(l)*(this + (1.0_wp - this)*is_positive(own - margin(l)))
            f(l) = f(l) + this*own
            slope(l) = slope(l) + this*side*first(l)
            d(l) = d(l) + this*side*second(l)
         end do
      end do
   end subroutine look_at_guards

   !> Value of the form and its first two derivatives.
   pure subroutine derivatives(mode, own, tone, at, cosine, sine, value, first, second)
      type(lane_mode_t), intent(in) :: mode
      real(wp), intent(in) :: own(lanes, mode%numbers), tone(lanes, mode%tones)
      real(wp), intent(in) :: at(lanes, mode%rows), cosine(lanes, mode%tones), sine(lanes, mode%tones)
      real(wp), dimension(lanes), intent(out) :: value, first, second

      integer :: k, l, n, t
      real(wp) :: u, v, part

      n = mode%terms
      value = own(:, mode%constant)
      first = 0.0_wp
      second = 0.0_wp
      do k = 1, 2*n
         !$omp simd
         do l = 1, lanes
            value(l) = value(l) + mode%series(0, k)*at(l, k)
            first(l) = first(l) + mode%series(1, k)*at(l, k)
            second(l) = second(l) + mode%series(2, k)*at(l, k)
         end do
      end do
      first = first/mode%step
      second = 2*second/mode%step**2
      do t = 1, mode%tones
         !$omp simd private(u, v, part)
         do l = 1, lanes
            u = own(l, mode%waves + 2*t - 1)
            v = own(l, mode%waves + 2*t)
            part = u*cosine(l, t) + v*sine(l, t)
            value(l) = value(l) + part
            first(l) = first(l) + tone(l, t)*(v*cosine(l, t) - u*sine(l, t))
            second(l) = second(l) - tone(l, t)**2*part
         end do
      end do
      do k = 1, mode%rigid
         !$omp simd
         do l = 1, lanes
            value(l) = value(l) + (mode%rigid_y(k)*at(l, 2*n + k) + mode%rigid_v(k)*at(l, 2*n + mode%rigid + k))
            first(l) = first(l) + (mode%rigid_y(k)*at(l, 2*n + mode%rigid + k) + mode%rigid_v(k)*own(l, mode%forces + k))
            second(l) = second(l) + mode%rigid_y(k)*own(l, mode%forces + k)
         end do
      end do
   end subroutine derivatives

   !> Move the end of the piece by the small `delta`, s.
   pure subroutine polish(mode, b, delta)
      type(lane_mode_t), intent(in) :: mode
      type(block_t), intent(inout) :: b
      real(wp), intent(in) :: delta(lanes)

      integer :: k, l, n, t
      real(wp) :: re, im, x, y, new

      n = mode%terms
      do k = 1, n
         !$omp simd private(re, im, x, y, new)
         do l = 1, lanes
            x = mode%decay(k)*delta(l)
            y = mode%turn(k)*delta(l)
            ! z + z²/2 + z³/6
            re = 1.0_wp + x*(1.0_wp/3)
            im = y*(1.0_wp/3)
            new = 1.0_wp + 0.5_wp*(x*re - y*im)
            im = 0.5_wp*(x*im + y*re)
            re = x*new - y*im
            im = x*im + y*new
            new = b%state(l, k) + (b%state(l, k)*re - b%state(l, n + k)*im)
            b%state(l, n + k) = b%state(l, n + k) + (b%state(l, k)*im + b%state(l, n + k)*re)
            b%state(l, k) = new
         end do
      end do
      call move_rigid(mode, b%own, delta, b%state)
      do t = 1, mode%tones
         !$omp simd private(re, im, y, new)
         do l = 1, lanes
            y = b%tone(l, t)*delta(l)
            re = -0.5_wp*y*y
            im = y*(1.0_wp - y*y*(1.0_wp/6))
            new = b%cosine(l, t) + (b%cosine(l, t)*re - b%sine(l, t)*im)
            b%sine(l, t) = b%sine(l, t) + (b%cosine(l, t)*im + b%sine(l, t)*re)
            b%cosine(l, t) = new
         end do
      end do
      b%tau = b%tau + delta
      call add_times(b%time, b%time_low, delta)
   end subroutine polish

   !> Add `step` to the times `time + time_low`, s (razy_core_tone).
   pure subroutine add_times(time, time_low, step)
      real(wp), intent(inout) :: time(lanes), time_low(lanes)
      real(wp), intent(in) :: step(lanes)

      real(wp) :: part, rest, total
      integer :: l

      !$omp simd private(part, rest, total)
      do l = 1, lanes
         total = time(l) + step(l)
         part = total - time(l)
         rest = (time(l) - (total - part)) + (step(l) - part) + time_low(l)
         time(l) = total + rest
         time_low(l) = rest - (time(l) - total)
      end do
   end subroutine add_times

   !> Cosine and sine of tones at `time + time_low`, s, as razy_core_tone forms them; `tone`: frequency, Hz, its low part, and the
   !> upper and lower half of its bits.
   pure subroutine turn_tone(tone, time, time_low, cosine, sine)
      real(wp), intent(in) :: tone(lanes, 4), time(lanes), time_low(lanes)
      real(wp), intent(out) :: cosine(lanes), sine(lanes)

      real(wp), parameter :: two_pi = 6.283185307179586476925_wp, splitter = 134217729.0_wp
      real(wp) :: angle(lanes), lower, rest, scaled, turns, upper
      integer :: l

      !$omp simd private(lower, rest, scaled, turns, upper)
      do l = 1, lanes
         scaled = splitter*time(l)
         upper = scaled - (scaled - time(l))
         lower = time(l) - upper
         turns = tone(l, 1)*time(l)
         rest = ((tone(l, 3)*upper - turns) + tone(l, 3)*lower + tone(l, 4)*upper) + tone(l, 4)*lower
         rest = rest + tone(l, 1)*time_low(l) + tone(l, 2)*time(l)
         angle(l) = two_pi*((turns - ((turns + shift) - shift)) + rest)
      end do
      call turn_by(angle, cosine, sine)
   end subroutine turn_tone

   !> Cosine and sine of angles of less than 1e6: reduced to a quarter turn about 0, and there by polynomials (Cody and Waite 1980;
   !> coefficients those of the Taylor series, whose next terms are below rounding).
   pure subroutine turn_by(angle, cosine, sine)
      real(wp), intent(in) :: angle(lanes)
      real(wp), intent(out) :: cosine(lanes), sine(lanes)

      real(wp), parameter :: quarter(3) = [1.57079632673412561417_wp, 6.07710050630396597660e-11_wp, 2.02226624879595063154e-21_wp]
      real(wp), parameter :: per_quarter = 0.636619772367581343076_wp
      real(wp) :: c, half, k, odd, r, s, sign_of, square
      integer :: l

      !$omp simd private(c, half, k, odd, r, s, sign_of, square)
      do l = 1, lanes
         k = (angle(l)*per_quarter + shift) - shift
         r = ((angle(l) - k*quarter(1)) - k*quarter(2)) - k*quarter(3)
         half = ((0.5_wp*k - 0.25_wp) + shift) - shift
         odd = k - 2*half
         sign_of = 1.0_wp - 2*(half - 2*(((0.5_wp*half - 0.25_wp) + shift) - shift))
         square = r*r
         s = 1.0_wp/362880 + square*(-1.0_wp/39916800 + square*(1.0_wp/6227020800.0_wp - square*(1.0_wp/1307674368000.0_wp)))
         s = r + r*square*(-1.0_wp/6 + square*(1.0_wp/120 + square*(-1.0_wp/5040 + square*s)))
         c = 1.0_wp/479001600.0_wp + square*(-1.0_wp/87178291200.0_wp + square*(1.0_wp/20922789888000.0_wp))
         c = -1.0_wp/720 + square*(1.0_wp/40320 + square*(-1.0_wp/3628800 + square*c))
         c = 1.0_wp + square*(-0.5_wp + square*(1.0_wp/24 + square*c))
         cosine(l) = sign_of*merge(-s, c, odd > 0.5_wp)
         sine(l) = sign_of*merge(c, s, odd > 0.5_wp)
      end do
   end subroutine turn_by

   !> Exponentials of numbers below 0 or not much above, to rounding; below -700 that of -700.
   pure subroutine grow_by(x, y)
      real(wp), intent(in) :: x(lanes)
      real(wp), intent(out) :: y(lanes)

      real(wp), parameter :: ln2(2) = [0.693147180369123816490_wp, 1.90821492927058770002e-10_wp]
      real(wp), parameter :: per_ln2 = 1.44269504088896338700_wp
      real(wp) :: arg, k, p, r
      integer :: l

      !$omp simd private(arg, k, p, r)
      do l = 1, lanes
         arg = max(x(l), -700.0_wp)
         k = arg*per_ln2 + shift
         r = k - shift
         r = (arg - r*ln2(1)) - r*ln2(2)
         p = 1.0_wp/3628800 + r*(1.0_wp/39916800 + r*(1.0_wp/479001600.0_wp + r*(1.0_wp/6227020800.0_wp)))
         p = 1.0_wp/5040 + r*(1.0_wp/40320 + r*(1.0_wp/362880 + r*p))
         p = 1.0_wp + (r + r*r*(0.5_wp + r*(1.0_wp/6 + r*(1.0_wp/24 + r*(1.0_wp/120 + r*(1.0_wp/720 + r*p))))))
         y(l) = p*transfer(ishft(transfer(k, 1_int64) + 1023_int64, 52), 1.0_wp)
      end do
   end subroutine grow_by

end module razy_exact_lanes_kernel
